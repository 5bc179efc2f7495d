#include "submissions/submission.h"

#include <algorithm>
#include <limits>

#include "base/characters.h"
#include "base/files.h"
#include "base/limits.h"
#include "base/text.h"
#include "submissions/archive.h"

namespace relign::submissions {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxManifestBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxText = 1000;  // bytes of a text for pages
constexpr std::size_t kMaxAuthors = 100;
constexpr unsigned kMaxSelfTestSteps = 100;

// Names become file names, addresses of pages and words of commands.
std::string word_mistake(const std::string& word, const std::string& signs) {
  constexpr std::size_t kLongest = 64;
  const auto plain = [](char letter) {
    return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || (letter >= '0' && letter <= '9');
  };
  const auto allowed = [&](char letter) { return plain(letter) || signs.find(letter) != std::string::npos; };
  if (!word.empty() && word.size() <= kLongest && plain(word.front()) && std::all_of(word.begin(), word.end(), allowed))
    return "";
  return "expected 1 to 64 letters, digits or '" + signs + "', starting with a letter or digit, found '" + word + "'";
}

// One line of text without terminal sequences or marks that change the writing direction.
std::string text_mistake(const std::string& text) {
  if (text.empty()) return "expected a text, found an empty string";
  if (text.size() > kMaxText)
    return "found " + std::to_string(text.size()) + " bytes; at most " + std::to_string(kMaxText) + " are allowed";
  return line_mistake(text);
}

class ManifestReader {
 public:
  explicit ManifestReader(const JsonSource& source) : source_(source), top_(source, "", problems_) {}

  Submission read() {
    Submission submission;
    submission.text = source_.text();
    submission.name = word("name", "._-");
    submission.version = word("version", "._-+");
    submission.summary = text("summary", true);
    submission.authors = authors();
    submission.licence = text("licence", true);
    submission.citation = text("citation", false);
    submission.homepage = homepage();
    read_algorithm(submission);
    submission.plugin = path("plugin");
    submission.training = training();
    submission.environment = path("environment");
    submission.self_test = self_test();
    top_.reject_unknown();
    throw_if_any(problems_);
    return submission;
  }

 private:
  std::string word(const std::string& key, const std::string& signs) {
    const std::string found = top_.required_string(key);
    if (top_.has(key) && top_.get(key)->is_string())
      if (const std::string mistake = word_mistake(found, signs); !mistake.empty()) top_.complain(key, mistake);
    return found;
  }

  std::string text(const std::string& key, bool required) {
    const std::string found = required ? top_.required_string(key) : top_.string(key, "");
    if (top_.has(key) && top_.get(key)->is_string())
      if (const std::string mistake = text_mistake(found); !mistake.empty()) top_.complain(key, mistake);
    return found;
  }

  std::vector<std::string> authors() {
    const Json* list = top_.get("authors");
    if (!list) {
      top_.complain_missing("authors", "a list of names");
      return {};
    }
    const bool names = list->is_array() && !list->empty() && list->size() <= kMaxAuthors &&
                       std::all_of(list->begin(), list->end(), [](const Json& one) { return one.is_string(); });
    if (!names) {
      top_.complain("authors", "expected a list of 1 to 100 names");
      return {};
    }
    auto found = list->get<std::vector<std::string>>();
    for (const std::string& author : found)
      if (const std::string mistake = text_mistake(author); !mistake.empty()) top_.complain("authors", mistake);
    return found;
  }

  // A page links to it, so that no other scheme, such as javascript, is allowed.
  std::string homepage() {
    std::string found = text("homepage", false);
    if (!found.empty() && found.rfind("https://", 0) != 0 && found.rfind("http://", 0) != 0)
      top_.complain("homepage", "expected an address that begins with https://, found '" + found + "'");
    return found;
  }

  std::string path(const std::string& key) {
    std::string found = top_.string(key, "");
    if (top_.has(key) && top_.get(key)->is_string())
      if (const std::string mistake = path_mistake(found); !mistake.empty())
        top_.complain(key, "found '" + found + "': " + mistake + "; expected a path in the submission's folder");
    return found;
  }

  void read_algorithm(Submission& submission) {
    submission.parameters = Json::object();
    if (!top_.get("algorithm")) {
      top_.complain_missing("algorithm", "an object with 'use', as in a suite");
      return;
    }
    ObjectReader reader(source_, "/algorithm", problems_);
    submission.use = reader.required_string("use");
    refuse_paths_outside("/algorithm/use", submission.use);
    submission.merit = reader.string("merit", "");
    submission.protocol = reader.string("protocol", "");
    if (const Json* parameters = reader.get("parameters")) {
      submission.parameters = *parameters;
      if (!parameters->is_object())
        reader.complain("parameters", std::string("expected an object, found ") + parameters->type_name());
      refuse_paths_outside("/algorithm/parameters", *parameters);
    }
    reader.reject_unknown();
  }

  // A sandbox shows the files that parameters name: none may be outside the archive.
  void refuse_paths_outside(const std::string& pointer, const Json& value) {
    if (value.is_structured())
      for (const Json& inner : value) refuse_paths_outside(pointer, inner);
    if (!value.is_string()) return;
    const fs::path path = value.get<std::string>();
    const bool leaves = std::find(path.begin(), path.end(), "..") != path.end();
    if (path.is_absolute() || leaves)
      problems_.push_back(source_.problem(
          pointer,
          "found '" + path.string() + "'; a path must be relative to the submission's folder " + "and inside it"));
  }

  Json training() {
    const Json* given = top_.get("training");
    if (!given) return nullptr;
    ObjectReader reader(source_, "/training", problems_);
    reader.integer("steps", 0, 0, std::numeric_limits<std::int64_t>::max());
    reader.integer("images", 0, 0, std::numeric_limits<std::int64_t>::max());
    reader.number("hours", 0, 0, std::numeric_limits<double>::max());
    const std::string hardware = reader.string("hardware", "");
    if (reader.has("hardware") && reader.get("hardware")->is_string())
      if (const std::string mistake = text_mistake(hardware); !mistake.empty()) reader.complain("hardware", mistake);
    reader.reject_unknown();
    return *given;
  }

  SelfTest self_test() {
    SelfTest test;
    if (!top_.get("self_test")) return test;
    ObjectReader reader(source_, "/self_test", problems_);
    test.scene = reader.string("scene", test.scene);
    test.noise_level = reader.string("noise_level", test.noise_level);
    for (const auto& [key, id] : {std::pair("scene", test.scene), std::pair("noise_level", test.noise_level)})
      if (const std::string mistake = word_mistake(id, "._-"); !mistake.empty())
        reader.complain(key, mistake + "; a self-test uses installed scenes and noise levels");
    test.steps = static_cast<unsigned>(reader.integer("steps", test.steps, 1, kMaxSelfTestSteps));
    reader.reject_unknown();
    return test;
  }

  const JsonSource& source_;
  std::vector<Problem> problems_;
  ObjectReader top_;
};

}  // namespace

Submission read_submission(const JsonSource& source) { return ManifestReader(source).read(); }

Submission read_submission(const fs::path& folder) {
  const fs::path file = folder / kManifestName;
  std::error_code error;
  if (fs::is_symlink(file, error))
    throw Error(ErrorKind::bad_input, "'" + file.string() + "' is a link; replace it by a copy of what it leads to");
  if (!fs::is_regular_file(file, error))
    throw Error(ErrorKind::bad_input, "'" + folder.string() + "' is not a submission: it has no " + kManifestName +
                                          "; see docs/submitting.md");
  const JsonSource source = JsonSource::from_text(read_file(file, kMaxManifestBytes), file.string());
  Submission submission = read_submission(source);
  std::vector<Problem> problems;
  for (const auto& [key, path] :
       {std::pair("plugin", submission.plugin), std::pair("environment", submission.environment)})
    if (!path.empty() && !fs::exists(folder / path, error))
      problems.push_back(source.problem(std::string("/") + key, "'" + path + "' does not exist in the submission"));
  throw_if_any(problems);
  return submission;
}

}  // namespace relign::submissions
