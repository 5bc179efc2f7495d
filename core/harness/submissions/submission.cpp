#include "submissions/submission.h"

#include <algorithm>

#include "base/characters.h"
#include "base/files.h"
#include "base/json_members.h"
#include "base/limits.h"
#include "base/schema.h"
#include "base/text.h"
#include "submissions/archive.h"

extern "C" {
extern const unsigned char relign_schema_submission[];
extern const unsigned long relign_schema_submission_size;
}

namespace relign::submissions {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxManifestBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxText = 1000;  // bytes of a text for pages

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

// The checks that the schema does not make.
class SubmissionChecks {
 public:
  SubmissionChecks(const JsonSource& source, std::vector<Problem>& problems) : source_(source), problems_(problems) {}

  void check(const Submission& submission, const Json& file) {
    refuse("/name", word_mistake(submission.name, "._-"));
    refuse("/version", word_mistake(submission.version, "._-+"));
    for (const char* key : {"summary", "licence", "citation", "homepage"})
      if (file.contains(key)) refuse(std::string("/") + key, text_mistake(file[key]));
    for (std::size_t i = 0; i < submission.authors.size(); ++i)
      refuse("/authors/" + std::to_string(i), text_mistake(submission.authors[i]));
    // A page links to it, so that no other scheme, such as javascript, is allowed.
    const std::string& home = submission.homepage;
    if (!home.empty() && home.rfind("https://", 0) != 0 && home.rfind("http://", 0) != 0)
      refuse("/homepage", "expected an address that begins with https://, found '" + home + "'");
    for (const auto& [key, path] : {std::pair("plugin", submission.plugin), {"environment", submission.environment}})
      if (file.contains(key))
        if (const std::string mistake = path_mistake(path); !mistake.empty())
          refuse(std::string("/") + key,
                 "found '" + path + "': " + mistake + "; expected a path in the submission's folder");
    refuse_paths_outside("/algorithm/use", submission.use);
    refuse_paths_outside("/algorithm/parameters", submission.parameters);
    if (const Json& hardware = member(submission.training, "hardware"); hardware.is_string())
      refuse("/training/hardware", text_mistake(hardware));
    for (const auto& [key, id] :
         {std::pair("scene", submission.self_test.scene), {"noise_level", submission.self_test.noise_level}})
      if (const std::string mistake = word_mistake(id, "._-"); !mistake.empty())
        refuse(std::string("/self_test/") + key, mistake + "; a self-test uses installed scenes and noise levels");
  }

 private:
  // Nothing where a mistake has been found already: the value is then one of the schema's.
  void refuse(const std::string& pointer, const std::string& mistake) {
    const Problem problem = source_.problem(pointer, mistake);
    const bool known = std::any_of(problems_.begin(), problems_.end(), [&](const Problem& other) {
      return other.line == problem.line && other.column == problem.column;
    });
    if (!mistake.empty() && !known && source_.root().contains(Json::json_pointer(pointer)))
      problems_.push_back(problem);
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
          pointer, "found '" + path.string() + "'; a path must be relative to the submission's folder and inside it"));
  }

  const JsonSource& source_;
  std::vector<Problem>& problems_;
};

}  // namespace

Submission read_submission(const JsonSource& source) {
  static const Schema schema(relign_schema_submission, relign_schema_submission_size);
  std::vector<Problem> problems;
  const Json file = schema.checked(source, problems);
  const Json &algorithm = file["algorithm"], &test = object_of(file, "self_test");
  Submission submission;
  submission.text = source.text();
  submission.name = file["name"];
  submission.version = file["version"];
  submission.summary = file["summary"];
  submission.authors = file["authors"].get<std::vector<std::string>>();
  submission.licence = file["licence"];
  submission.citation = text_of(file, "citation");
  submission.homepage = text_of(file, "homepage");
  submission.use = algorithm["use"];
  submission.parameters = object_of(algorithm, "parameters");
  submission.merit = text_of(algorithm, "merit");
  submission.protocol = text_of(algorithm, "protocol");
  submission.plugin = text_of(file, "plugin");
  submission.environment = text_of(file, "environment");
  submission.training = member(file, "training");
  submission.self_test = {test.value("scene", submission.self_test.scene),
                          test.value("noise_level", submission.self_test.noise_level),
                          test.value("steps", submission.self_test.steps)};
  SubmissionChecks(source, problems).check(submission, file);
  throw_if_any(problems);
  return submission;
}

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
