#include "leaderboard/evaluation.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/characters.h"
#include "base/files.h"
#include "base/json_members.h"
#include "base/limits.h"
#include "base/own_command.h"
#include "base/text.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;

constexpr double kMost = 1e15;  // of a training's cost

JsonSource limited_source(const fs::path& file) {
  std::error_code ignored;
  if (fs::is_symlink(file, ignored)) throw Error(ErrorKind::bad_input, "'" + file.string() + "' is a link, not a file");
  return JsonSource::from_text(read_file(file, kMaxEvaluationBytes), file.string());
}

// All texts below a value are shown on pages.
void refuse_hidden_characters(const JsonSource& source, const Json& value, const std::string& pointer,
                              std::vector<Problem>& problems) {
  if (value.is_string()) {
    if (const std::string mistake = line_mistake(value.get_ref<const std::string&>()); !mistake.empty())
      problems.push_back(source.problem(pointer, mistake));
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i)
      refuse_hidden_characters(source, value[i], pointer + "/" + std::to_string(i), problems);
  } else if (value.is_object()) {
    for (const auto& [key, inner] : value.items())
      refuse_hidden_characters(source, inner, pointer + "/" + key, problems);
  }
}

std::vector<std::string> required_words(ObjectReader& reader, const std::string& key) {
  const Json* list = reader.get(key);
  if (!list) {
    reader.complain_missing(key, "a list of strings");
    return {};
  }
  std::vector<std::string> words;
  if (list->is_array())
    for (const Json& word : *list)
      if (word.is_string()) words.push_back(word);
  if (!list->is_array() || words.size() != list->size()) reader.complain(key, "expected a list of strings");
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  return words;
}

std::string required_name(ObjectReader& reader, const std::string& key) {
  const std::string name = reader.required_string(key);
  if (reader.has(key) && (name.empty() || name.size() > kMaxNameLength))
    reader.complain(key, "expected 1 to " + std::to_string(kMaxNameLength) + " bytes");
  else if (const std::string mistake = letters_mistake(name); !mistake.empty())
    reader.complain(key, mistake);
  return name;
}

std::string required_hash(ObjectReader& reader, const std::string& key) {
  const std::string hash = reader.required_string(key);
  if (reader.has(key) && (hash.size() != 64 || hash.find_first_not_of("0123456789abcdef") != std::string::npos))
    reader.complain(key, "expected 64 lower-case hexadecimal digits");
  return hash;
}

bool required_flag(ObjectReader& reader, const std::string& key) {
  if (!reader.has(key)) reader.complain_missing(key, "true or false");
  return reader.boolean(key, false);
}

// Sorts as text: of equal length up to the day.
bool is_date(const std::string& text) {
  constexpr std::string_view kForm = "dddd-dd-dd";
  if (text.size() < kForm.size() || text.size() > 40) return false;
  for (std::size_t i = 0; i < kForm.size(); ++i)
    if (kForm[i] == 'd' ? text[i] < '0' || text[i] > '9' : text[i] != kForm[i]) return false;
  const std::chrono::year_month_day day(std::chrono::year(std::stoi(text.substr(0, 4))),
                                        std::chrono::month(static_cast<unsigned>(std::stoi(text.substr(5, 2)))),
                                        std::chrono::day(static_cast<unsigned>(std::stoi(text.substr(8, 2)))));
  if (!day.ok()) return false;
  return text.size() == kForm.size() || text[kForm.size()] == 'T';
}

// A null is a cost that is not stated.
double cost_of(ObjectReader& reader, const std::string& key) {
  const Json* value = reader.get(key);
  if (!value || value->is_null()) return std::nan("");
  return reader.number(key, std::nan(""), 0, kMost);
}

std::optional<TrainingCost> training_of(const JsonSource& source, ObjectReader& method,
                                        std::vector<Problem>& problems) {
  const Json* value = method.get("training");
  if (!value || value->is_null()) return std::nullopt;
  ObjectReader reader(source, method.pointer_to("training"), problems);
  TrainingCost cost;
  cost.steps = cost_of(reader, "steps");
  cost.images = cost_of(reader, "images");
  cost.hours = cost_of(reader, "hours");
  // The manifest of results, from which baselines have theirs, calls it machine.
  cost.hardware = reader.string("hardware", reader.string("machine", ""));
  reader.reject_unknown();
  return cost;
}

std::vector<EvaluatedMethod> methods_of(const JsonSource& source, ObjectReader& root, std::vector<Problem>& problems) {
  const Json* list = root.get("methods");
  if (!list || !list->is_array() || list->empty()) {
    root.complain(list ? "methods" : "", "expected a list \"methods\" with at least one method");
    return {};
  }
  std::vector<EvaluatedMethod> methods;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader reader(source, "/methods/" + std::to_string(i), problems);
    EvaluatedMethod method;
    method.name = required_name(reader, "name");
    method.observes = required_words(reader, "observes");
    method.protocol = reader.required_string("protocol");
    method.training = training_of(source, reader, problems);
    method.submitted = required_flag(reader, "submitted");
    reader.reject_unknown();
    for (const EvaluatedMethod& other : methods)
      if (other.name == method.name && other.protocol == method.protocol)
        reader.complain("name", "'" + method.name + "' is listed twice with the protocol '" + method.protocol + "'");
    methods.push_back(std::move(method));
  }
  if (std::none_of(methods.begin(), methods.end(), [](const EvaluatedMethod& one) { return one.submitted; }))
    root.complain("methods", "expected at least one method with \"submitted\": true");
  return methods;
}

// A plain name, so that nothing outside the folder is read.
std::string inner_folder(ObjectReader& reader) {
  const std::string name = reader.string("results", "results");
  if (name.empty() || name == "." || name == ".." || name.find_first_of(std::string("/\\\0", 3)) != std::string::npos)
    reader.complain("results", "expected the name of a folder beside this file, found '" + name + "'");
  return name;
}

Json to_json(const std::optional<TrainingCost>& training) {
  if (!training) return nullptr;
  Json json = {{"steps", number_or_null(training->steps)},
               {"images", number_or_null(training->images)},
               {"hours", number_or_null(training->hours)}};
  if (!training->hardware.empty()) json["hardware"] = training->hardware;
  return json;
}

}  // namespace

Evaluation read_evaluation(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_regular_file(folder / "evaluation.json", ignored))
    throw Error(ErrorKind::bad_input, "'" + folder.string() +
                                          "' is not an evaluation folder, since it has no file evaluation.json; create "
                                          "one with '" +
                                          own_command("submit evaluate") + "'");
  const JsonSource source = limited_source(folder / "evaluation.json");
  std::vector<Problem> problems;
  ObjectReader root(source, "", problems);
  Evaluation evaluation;
  evaluation.folder = folder;
  if (const std::string format = root.required_string("format"); root.has("format") && format != kEvaluationFormat)
    root.complain("format", "expected '" + std::string(kEvaluationFormat) + "', found '" + format +
                                "'; a newer version of relign-bench may read it");
  evaluation.name = required_name(root, "name");
  evaluation.version = required_name(root, "version");
  evaluation.archive_sha256 = required_hash(root, "archive_sha256");
  if (!root.get("suite")) root.complain_missing("suite", "an object");
  ObjectReader suite(source, "/suite", problems);
  if (root.has("suite")) {
    evaluation.suite.name = suite.required_string("name");
    evaluation.suite.sha256 = required_hash(suite, "sha256");
    evaluation.suite.instance_set = required_name(suite, "instance_set");
    suite.reject_unknown();
  }
  evaluation.sealed = required_flag(root, "sealed");
  evaluation.sandbox = required_flag(root, "sandbox");
  evaluation.date = root.required_string("date");
  if (root.has("date") && !is_date(evaluation.date))
    root.complain("date", "expected a date as '2026-11-24' or '2026-11-24T17:05:00Z', found '" + evaluation.date + "'");
  evaluation.program_version = root.required_string("program_version");
  evaluation.observes = required_words(root, "class");
  if (!root.get("budget")) root.complain_missing("budget", "an object");
  ObjectReader budget(source, "/budget", problems);
  if (root.has("budget")) {
    if (!budget.has("steps")) budget.complain_missing("steps", "an integer");
    evaluation.steps = static_cast<unsigned>(budget.integer("steps", 0, 0, kMaxSteps));
    budget.reject_unknown();
  }
  evaluation.methods = methods_of(source, root, problems);
  evaluation.results = inner_folder(root);
  root.reject_unknown();
  refuse_hidden_characters(source, source.root(), "", problems);
  throw_if_any(problems);
  return evaluation;
}

Submission read_submission(const fs::path& folder) {
  const JsonSource source = limited_source(folder / "submission.json");
  std::vector<Problem> problems;
  ObjectReader root(source, "", problems);
  Submission submission;
  submission.name = required_name(root, "name");
  submission.version = required_name(root, "version");
  submission.summary = root.string("summary", "");
  submission.licence = root.string("licence", "");
  submission.citation = root.string("citation", "");
  submission.homepage = root.string("homepage", "");
  for (const Json& author : list_of(source.root(), "authors"))
    if (author.is_string()) submission.authors.push_back(author);
  submission.training = member(source.root(), "training");
  submission.parameters = member(object_of(source.root(), "algorithm"), "parameters");
  for (const char* key : {"name", "version", "summary", "authors", "licence", "citation", "homepage"})
    refuse_hidden_characters(source, member(source.root(), key), "/" + std::string(key), problems);
  throw_if_any(problems);
  return submission;
}

Json to_json(const Evaluation& evaluation) {
  Json methods = Json::array();
  for (const EvaluatedMethod& method : evaluation.methods)
    methods.push_back({{"name", method.name},
                       {"observes", method.observes},
                       {"protocol", method.protocol},
                       {"training", to_json(method.training)},
                       {"submitted", method.submitted}});
  return {{"format", kEvaluationFormat},
          {"name", evaluation.name},
          {"version", evaluation.version},
          {"archive_sha256", evaluation.archive_sha256},
          {"suite",
           {{"name", evaluation.suite.name},
            {"sha256", evaluation.suite.sha256},
            {"instance_set", evaluation.suite.instance_set}}},
          {"sealed", evaluation.sealed},
          {"sandbox", evaluation.sandbox},
          {"date", evaluation.date},
          {"program_version", evaluation.program_version},
          {"class", evaluation.observes},
          {"budget", {{"steps", evaluation.steps}}},
          {"methods", methods},
          {"results", evaluation.results}};
}

}  // namespace relign::leaderboard
