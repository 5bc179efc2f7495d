#include "suites/entries.h"

#include <algorithm>
#include <map>
#include <utility>

#include "base/baselines.h"
#include "base/characters.h"
#include "base/limits.h"
#include "base/text.h"
#include "plugin_host/manifest.h"
#include "plugin_host/training.h"

namespace relign::suites {
namespace {

constexpr std::size_t kMaxTrainings = 100;
const std::vector<std::string> kProtocols = {"paper", "blind"};
const std::vector<std::string> kMerits = {"combined", "rmse", "mtf", "edge_energy"};

// Names that distinguish the files: their stems, or their whole paths where stems are equal.
std::vector<std::string> training_names(const std::vector<std::string>& files) {
  std::vector<std::string> names;
  for (const std::string& file : files) names.push_back(std::filesystem::path(file).stem().string());
  std::vector<std::string> sorted = names;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end()) return names;
  for (std::size_t index = 0; index < files.size(); ++index) {
    names[index] = std::filesystem::path(files[index]).lexically_normal().replace_extension().generic_string();
    std::replace(names[index].begin(), names[index].end(), '/', '-');
  }
  return names;
}

}  // namespace

std::string one_of(ObjectReader& reader, const std::string& key, const std::vector<std::string>& allowed,
                   const std::string& fallback) {
  const std::string found = reader.string(key, fallback);
  if (found == fallback || std::find(allowed.begin(), allowed.end(), found) != allowed.end()) return found;
  const std::string nearest = nearest_name(found, allowed);
  reader.complain(key, "found '" + found + "'; allowed: " + join(allowed, ", ") +
                           (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
  return fallback;
}

std::string name_mistake(const std::string& name) {
  if (name.find_first_not_of(' ') == std::string::npos) return "a name must not be empty";
  if (name.front() == ' ' || name.back() == ' ') return "a name must not begin or end with a space";
  if (name.size() > 80) return "a name must have at most 80 characters";
  if (name.front() == '.') return "a name must not start with a dot";
  if (name.find_first_of("/\\") != std::string::npos) return "a name must not contain slashes";
  if (std::string mistake = line_mistake(name); !mistake.empty()) return mistake;
  return letters_mistake(name);
}

std::vector<std::string> read_protocols(ObjectReader& reader, const std::vector<std::string>& fallback) {
  const Json* list = reader.get("protocols");
  const std::string one = one_of(reader, "protocol", kProtocols, fallback.front());
  if (!list) return reader.has("protocol") ? std::vector{one} : fallback;
  if (reader.has("protocol")) {
    reader.complain("protocols", "found 'protocol' and 'protocols'; expected one of them, not both");
    return fallback;
  }
  std::vector<std::string> found;
  if (list->is_array())
    for (const Json& name : *list)
      if (name.is_string() && std::find(kProtocols.begin(), kProtocols.end(), name) != kProtocols.end() &&
          std::find(found.begin(), found.end(), name) == found.end())
        found.push_back(name.get<std::string>());
  if (!found.empty() && found.size() == list->size()) return found;
  reader.complain("protocols", "expected a list of different protocols; allowed: " + join(kProtocols, ", "));
  return fallback;
}

EntryReader::EntryReader(const JsonSource& source, const std::filesystem::path& relative_to,
                         plugin_host::Catalog& catalog, EntryDefaults defaults, std::vector<Problem>& problems)
    : source_(source),
      relative_to_(relative_to),
      catalog_(catalog),
      defaults_(std::move(defaults)),
      problems_(problems) {}

void EntryReader::complain(const std::string& pointer, const std::string& message) {
  problems_.push_back(source_.problem(pointer, message));
}

std::vector<Entry> EntryReader::read(ObjectReader& suite, const std::string& key, plugin_host::Kind kind) {
  std::vector<Entry> found;
  const Json* list = suite.get(key);
  if (!list) return found;  // reported with the other keys of the suite
  if (!list->is_array() || list->empty()) {
    suite.complain(key, list->is_array() ? "expected at least one entry, found an empty list"
                                         : std::string("expected a list, found ") + list->type_name());
    return found;
  }
  for (std::size_t index = 0; index < list->size(); ++index) {
    for (Entry& entry : read_entry(suite.pointer_to(key) + "/" + std::to_string(index), (*list)[index], kind))
      if (entry.usable) found.push_back(std::move(entry));
  }
  refuse_clashes(found, plugin_host::is_algorithm(kind));
  return found;
}

// Returns one entry, or one for each of its trainings.
std::vector<Entry> EntryReader::read_entry(const std::string& pointer, const Json& value, plugin_host::Kind kind) {
  Entry entry;
  entry.pointer = pointer;
  entry.protocols = defaults_.protocols;
  entry.steps = defaults_.steps;
  if (value.is_string()) {
    resolve(entry, kind, value.get<std::string>(), nullptr, pointer);
    return {entry};
  }
  if (!value.is_object()) {
    complain(pointer, std::string("expected an id, a path or an object with 'use', found ") + value.type_name());
    return {};
  }
  ObjectReader reader(source_, pointer, problems_);
  const std::size_t mistakes = problems_.size();
  const std::string use = reader.required_string("use");
  entry.named = reader.has("name");
  entry.name = reader.string("name", "");
  const Json* parameters = reader.get("parameters");
  if (parameters && !parameters->is_object()) {
    reader.complain("parameters", std::string("expected an object, found ") + parameters->type_name());
    parameters = nullptr;
  }
  const Json* trainings = nullptr;
  if (plugin_host::is_algorithm(kind)) {
    trainings = reader.get("trainings");
    entry.protocols = read_protocols(reader, defaults_.protocols);
    entry.merit = one_of(reader, "merit", kMerits, "");
    entry.steps = static_cast<unsigned>(reader.integer("steps", defaults_.steps, 1, kMaxSteps));
  }
  reader.reject_unknown();
  if (((parameters && !parameters->empty()) || trainings) && !entry.named)
    complain(pointer,
             std::string(trainings ? "a list of trainings needs" : "changed parameters need") + " a 'name' for tables");
  if (entry.named)
    if (const std::string mistake = name_mistake(entry.name); !mistake.empty() && problems_.size() == mistakes)
      reader.complain("name", mistake);
  if (use.empty()) {
    if (problems_.size() == mistakes) reader.complain("use", "expected an id, a preset or a path");
    return {};
  }
  const Json given = parameters ? *parameters : Json(nullptr);
  if (trainings) return with_trainings(reader, entry, kind, use, given, *trainings);
  resolve(entry, kind, use, given, pointer + "/use");
  return {entry};
}

// Copies of `entry` for each model file of "trainings"; the file becomes the parameter named by the manifest's
// "training".
std::vector<Entry> EntryReader::with_trainings(ObjectReader& reader, const Entry& entry, plugin_host::Kind kind,
                                               const std::string& use, const Json& parameters, const Json& trainings) {
  const auto plugin = catalog_.plugin_of(kind, use, relative_to_);
  const std::string parameter = plugin ? plugin_host::training_parameter(*plugin) : "";
  if (parameter.empty()) {
    Entry unused = entry;
    if (plugin)
      reader.complain("trainings", "'" + plugin->id +
                                       "' has no trained model: 'training' in its manifest names no "
                                       "file parameter");
    else
      resolve(unused, kind, use, parameters, entry.pointer + "/use");  // reports the mistake
    return {};
  }
  std::vector<std::string> files;
  if (trainings.is_array())
    for (const Json& file : trainings)
      if (file.is_string() && !file.get<std::string>().empty()) files.push_back(file.get<std::string>());
  if (files.empty() || files.size() != trainings.size() || files.size() > kMaxTrainings) {
    reader.complain("trainings", "expected a list of 1 to " + std::to_string(kMaxTrainings) +
                                     " model files, one per training, for example [\"seed1.onnx\", \"seed2.onnx\"]");
    return {};
  }
  if (parameters.is_object() && parameters.contains(parameter)) {
    complain(entry.pointer + "/parameters/" + parameter, "'trainings' sets this parameter; give the file there");
    return {};
  }
  std::vector<Entry> list;
  const std::vector<std::string> names = training_names(files);
  for (std::size_t index = 0; index < files.size(); ++index) {
    const std::string pointer = entry.pointer + "/trainings/" + std::to_string(index);
    Entry one = entry;
    one.method = entry.name;
    one.training = names[index];
    one.name = entry.name + " (" + one.training + ")";
    Json given = parameters.is_object() ? parameters : Json::object();
    given[parameter] = files[index];
    const std::size_t mistakes = problems_.size();
    resolve(one, kind, use, given, pointer, entry.pointer + "/parameters/" + parameter);
    if (const std::string mistake = name_mistake(one.name); !mistake.empty() && problems_.size() == mistakes)
      complain(pointer, "invalid name '" + one.name + "': " + mistake);
    for (std::size_t before = 0; before < list.size(); ++before)
      if (one.usable && list[before].choice.identity == one.choice.identity)
        complain(pointer, "duplicate of the model at " + entry.pointer + "/trainings/" + std::to_string(before));
    list.push_back(std::move(one));
  }
  return list;
}

// The catalogue reports mistakes relative to the entry; `use_pointer` is the pointer of its id, and mistakes at
// `also_there` of the entry are reported there, too.
void EntryReader::resolve(Entry& entry, plugin_host::Kind kind, const std::string& use, const Json& parameters,
                          const std::string& use_pointer, const std::string& also_there) {
  std::vector<Problem> found;
  if (use.size() > kMaxNameLength) {  // the search for similar names would take minutes
    complain(use_pointer, "an id or a path has at most " + std::to_string(kMaxNameLength) + " characters, found " +
                              std::to_string(use.size()));
    entry.usable = false;
    return;
  }
  try {
    entry.choice = catalog_.resolve(kind, use, parameters, relative_to_, found);
  } catch (const Error& error) {
    // Reports a refused plugin together with the suite's other mistakes.
    Problem problem;
    problem.message = error.what();
    found.push_back(problem);
  }
  for (const Problem& problem : found) {
    // Mistakes in a document that a path names have a position in that document.
    if (!problem.file.empty()) {
      problems_.push_back(problem);
      continue;
    }
    const std::string pointer = entry.pointer + problem.pointer;
    complain(problem.pointer.empty() || pointer == also_there ? use_pointer : pointer, problem.message);
  }
  entry.usable = entry.choice.plugin != nullptr;
  if (!entry.usable) return;
  refuse_nested(entry, entry.choice, entry.pointer);
  if (!entry.named) {
    entry.name = entry.choice.id;
    if (const std::string mistake = name_mistake(entry.name); !mistake.empty())
      complain(use_pointer, "invalid name '" + entry.name + "' (" + mistake + "); give the entry a 'name'");
  }
  if (plugin_host::is_algorithm(kind)) refuse_name_of_baseline(entry, entry.named ? entry.pointer : use_pointer);
}

// Readers compare every method with what they take for the baseline.
void EntryReader::refuse_name_of_baseline(const Entry& entry, const std::string& pointer) {
  const std::string& name = entry.method.empty() ? entry.name : entry.method;
  const std::string baseline = baseline_like(name), &plugin = entry.choice.plugin->id;
  if (!baseline.empty() && plugin != baseline)
    complain(pointer, "'" + name + "' reads as the baseline '" + baseline + "', but the entry is the plugin '" +
                          plugin + "'; give it another 'name'");
}

// Algorithms that cannot run inside others; `pointer` is that of the outer one.
void EntryReader::refuse_nested(const Entry& entry, const plugin_host::Choice& outer, const std::string& pointer) {
  const bool blind = std::find(entry.protocols.begin(), entry.protocols.end(), "blind") != entry.protocols.end();
  for (const auto& [parameter, inner] : outer.algorithms) {
    const std::string at = pointer + "/parameters/" + parameter;
    if (const std::string mistake = plugin_host::nesting_mistake(*outer.plugin, *inner->plugin, blind);
        !mistake.empty())
      complain(at, mistake);
    refuse_nested(entry, *inner, at);
  }
}

// Rows of a table need different names; and one scene under two names would run the same trials twice.
void EntryReader::refuse_clashes(const std::vector<Entry>& entries, bool algorithms) {
  std::map<std::string, std::string> by_name, by_identity;
  for (const Entry& entry : entries) {
    std::vector<std::string> keys = {entry.name};
    if (algorithms) {
      keys.clear();
      for (const std::string& protocol : entry.protocols) keys.push_back(entry.name + "\n" + protocol);
    }
    bool fresh_name = true;
    for (const std::string& key : keys) {
      const auto [same_name, is_fresh] = by_name.emplace(key, entry.pointer);
      if (!is_fresh && fresh_name)
        complain(entry.pointer, "duplicate name '" + entry.name + "', already used by " + same_name->second +
                                    (algorithms ? " under the same protocol" : "") +
                                    "; give one of them another 'name'");
      fresh_name = fresh_name && is_fresh;
    }
    if (algorithms || !fresh_name) continue;
    const auto [same, fresh] = by_identity.emplace(entry.choice.identity, entry.pointer);
    if (!fresh) complain(entry.pointer, "duplicate of " + same->second + " under another name");
  }
}

}  // namespace relign::suites
