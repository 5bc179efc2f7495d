#include "suites/suite.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "base/baselines.h"
#include "base/characters.h"
#include "base/limits.h"
#include "base/text.h"
#include "plugin_host/nesting.h"
#include "plugin_host/training.h"
#include "suites/secret.h"

namespace relign::suites {
namespace {

constexpr std::int64_t kMaxInstances = 1'000'000;
constexpr double kMaxTrialSeconds = 1e7;   // seconds
constexpr std::int64_t kMinMemoryMb = 64;  // MB
constexpr std::size_t kMaxTrainings = 100;
const std::vector<std::string> kProtocols = {"paper", "blind"};
const std::vector<std::string> kMerits = {"combined", "rmse", "mtf", "edge_energy"};
const std::vector<std::string> kLimits = {"soft", "hard"};
const std::vector<std::string> kMeasures = {"rmse", "yield"};
const std::vector<std::string> kRules = {"own", "best", "current"};
constexpr double kRelevantRatio = 1.1;

// Reads one of a few allowed strings; returns the fallback after a mistake.
std::string one_of(ObjectReader& reader, const std::string& key, const std::vector<std::string>& allowed,
                   const std::string& fallback) {
  const std::string found = reader.string(key, fallback);
  if (found == fallback || std::find(allowed.begin(), allowed.end(), found) != allowed.end()) return found;
  const std::string nearest = nearest_name(found, allowed);
  reader.complain(key, "found '" + found + "'; allowed: " + join(allowed, ", ") +
                           (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
  return fallback;
}

// Restricted because names appear in tables, file names and on command lines (--only algorithm=NAME).
std::string name_mistake(const std::string& name) {
  if (name.empty()) return "a name must not be empty";
  if (name.size() > 80) return "a name must have at most 80 characters";
  if (name.front() == '.') return "a name must not start with a dot";
  if (name.find_first_of("/\\") != std::string::npos) return "a name must not contain slashes";
  return line_mistake(name);
}

// One entry of scenes, noise_levels or algorithms, before checks against other entries.
struct Entry {
  std::string pointer;
  bool usable = false;
  std::string name;
  bool named = false;
  plugin_host::Choice choice;
  std::vector<std::string> protocols;
  std::string merit;
  unsigned steps = 0;
  std::string method, training;  // for an entry with a list of trainings
};

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

struct Defaults {
  std::vector<std::string> protocols = {"paper"};
  unsigned steps = 50;
};

class SuiteReader {
 public:
  SuiteReader(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog)
      : source_(source), relative_to_(relative_to), catalog_(catalog), top_(source, "", problems_) {}

  Suite read() {
    Suite suite;
    suite.file = source_.file();
    suite.text = source_.text();
    suite.name = top_.string("name", std::filesystem::path(source_.file()).stem().string());
    if (const std::string mistake = name_mistake(suite.name); top_.has("name") && !mistake.empty())
      top_.complain("name", mistake);
    suite.seed =
        static_cast<std::uint64_t>(top_.integer("seed", kDefaultSeed, 0, std::numeric_limits<std::int64_t>::max()));
    suite.commitment = top_.string("commitment", "");
    if (top_.has("commitment") && !is_commitment(suite.commitment))
      top_.complain("commitment", "expected \"sha256:\" and 64 hexadecimal digits, as relign-bench seal prints it");
    suite.instances = static_cast<unsigned>(top_.integer("instances", kDefaultInstances, 1, kMaxInstances));
    suite.first_instance = static_cast<unsigned>(
        top_.integer("first_instance", kDefaultFirstInstance, 0, std::numeric_limits<std::int32_t>::max()));
    defaults_.steps = static_cast<unsigned>(top_.integer("steps", 50, 1, kMaxSteps));
    defaults_.protocols = read_protocols(top_, defaults_.protocols);
    suite.limits = one_of(top_, "limits", kLimits, kDefaultLimits);
    for (Entry& entry : entries("scenes", plugin_host::Kind::scene))
      suite.scenes.push_back({std::move(entry.name), std::move(entry.choice)});
    for (Entry& entry : entries("noise_levels", plugin_host::Kind::noise_level))
      suite.levels.push_back({std::move(entry.name), std::move(entry.choice)});
    for (Entry& entry : entries("algorithms", plugin_host::Kind::optimizer)) {
      AlgorithmEntry algorithm;
      algorithm.name = std::move(entry.name);
      algorithm.choice = std::move(entry.choice);
      algorithm.merit = std::move(entry.merit);
      algorithm.steps = entry.steps;
      algorithm.method = std::move(entry.method);
      algorithm.training = std::move(entry.training);
      for (const std::string& protocol : entry.protocols) {
        algorithm.protocol = protocol;
        suite.algorithms.push_back(algorithm);
      }
    }
    suite.trial_seconds = top_.number("trial_seconds", suite.trial_seconds, 0.1, kMaxTrialSeconds);
    suite.trial_memory_mb = static_cast<unsigned>(top_.integer("trial_memory_mb", 0, 0, 1'000'000'000));
    if (top_.has("trial_memory_mb") && suite.trial_memory_mb < kMinMemoryMb)
      top_.complain("trial_memory_mb", "must be at least " + std::to_string(kMinMemoryMb) + ", the need of a worker");
    suite.machine_time = machine_time();
    suite.cycle = cycle();
    suite.cost = cost(suite);
    suite.spec = spec();
    suite.targets = targets();
    suite.analysis = analysis(suite);
    top_.reject_unknown();
    std::stable_sort(problems_.begin(), problems_.end(), [](const Problem& a, const Problem& b) {
      return std::tie(a.file, a.line, a.column) < std::tie(b.file, b.line, b.column);
    });
    throw_if_any(problems_);
    add_baselines(suite);
    refuse_too_many_trials(suite);
    return suite;
  }

 private:
  void refuse_too_many_trials(const Suite& suite) const {
    const double trials = static_cast<double>(suite.scenes.size()) * static_cast<double>(suite.levels.size()) *
                          static_cast<double>(suite.algorithms.size()) * suite.instances;
    if (trials <= static_cast<double>(kMaxTrials)) return;
    throw Error(ErrorKind::bad_input,
                source_.file() + ": " + significant(trials, 3) + " trials: " + std::to_string(suite.scenes.size()) +
                    " scenes x " + std::to_string(suite.levels.size()) + " noise levels x " +
                    std::to_string(suite.algorithms.size()) + " methods x " + std::to_string(suite.instances) +
                    " instances; at most " + std::to_string(kMaxTrials) +
                    " are allowed: reduce 'instances', or divide the suite into several");
  }
  void complain(const std::string& pointer, const std::string& message) {
    problems_.push_back(source_.problem(pointer, message));
  }

  std::vector<Entry> entries(const std::string& key, plugin_host::Kind kind) {
    std::vector<Entry> found;
    const Json* list = top_.get(key);
    if (!list) {
      if (source_.root().is_object()) top_.complain_missing(key, "a list of entries");
      return found;
    }
    if (!list->is_array() || list->empty()) {
      top_.complain(key, list->is_array() ? "expected at least one entry, found an empty list"
                                          : std::string("expected a list, found ") + list->type_name());
      return found;
    }
    for (std::size_t index = 0; index < list->size(); ++index) {
      for (Entry& entry : read_entry(top_.pointer_to(key) + "/" + std::to_string(index), (*list)[index], kind))
        if (entry.usable) found.push_back(std::move(entry));
    }
    refuse_clashes(found, plugin_host::is_algorithm(kind));
    return found;
  }

  // Returns one entry, or one for each of its trainings.
  std::vector<Entry> read_entry(const std::string& pointer, const Json& value, plugin_host::Kind kind) {
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
      complain(pointer, std::string(trainings ? "a list of trainings needs" : "changed parameters need") +
                            " a 'name' for tables");
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
  std::vector<Entry> with_trainings(ObjectReader& reader, const Entry& entry, plugin_host::Kind kind,
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
  void resolve(Entry& entry, plugin_host::Kind kind, const std::string& use, const Json& parameters,
               const std::string& use_pointer, const std::string& also_there = "") {
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
  void refuse_name_of_baseline(const Entry& entry, const std::string& pointer) {
    const std::string& name = entry.method.empty() ? entry.name : entry.method;
    const std::string baseline = baseline_like(name), &plugin = entry.choice.plugin->id;
    if (!baseline.empty() && plugin != baseline)
      complain(pointer, "'" + name + "' reads as the baseline '" + baseline + "', but the entry is the plugin '" +
                            plugin + "'; give it another 'name'");
  }

  // Algorithms that cannot run inside others; `pointer` is that of the outer one.
  void refuse_nested(const Entry& entry, const plugin_host::Choice& outer, const std::string& pointer) {
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
  void refuse_clashes(const std::vector<Entry>& entries, bool algorithms) {
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

  // Reads "protocol" or the list "protocols"; returns the fallback where both are missing, and after a mistake.
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

  // Checks the names of contrasts against the algorithms, including home and random.
  Json analysis(const Suite& suite) {
    if (!top_.get("analysis")) return nullptr;
    const std::string pointer = top_.pointer_to("analysis");
    const Json& written = *top_.get("analysis");
    if (!written.is_object()) {
      top_.complain("analysis", std::string("expected an object, found ") + written.type_name());
      return nullptr;
    }
    const std::size_t mistakes = problems_.size();
    ObjectReader reader(source_, pointer, problems_);
    one_of(reader, "primary", kMeasures, "rmse");
    one_of(reader, "rule", kRules, "own");
    reader.number("smallest_relevant_ratio", kRelevantRatio, 1, 1000);
    reader.number("yield", 0, 0, 1);
    if (const Json* contrasts = reader.get("contrasts")) {
      const auto is_pair = [](const Json& pair) {
        return pair.is_array() && pair.size() == 2 && pair[0].is_string() && pair[1].is_string() && pair[0] != pair[1];
      };
      if (!contrasts->is_array() || contrasts->empty() || !std::all_of(contrasts->begin(), contrasts->end(), is_pair)) {
        reader.complain("contrasts",
                        "expected a list of pairs of different methods, for example [[\"bo-gp\", \"random\"]]");
      } else {
        for (std::size_t i = 0; i < contrasts->size(); ++i)
          for (std::size_t side = 0; side < 2; ++side)
            check_method_name(suite, (*contrasts)[i][side].get<std::string>(),
                              pointer + "/contrasts/" + std::to_string(i) + "/" + std::to_string(side));
      }
    }
    reader.reject_unknown();
    return problems_.size() == mistakes ? analysis_json(written) : Json();
  }

  MachineTimeKeys machine_time() {
    if (!top_.get("machine_time")) return {};
    return read_machine_time(source_, top_.pointer_to("machine_time"), problems_);
  }

  Json cycle() {
    const Json* value = top_.get("cycle");
    if (!value) return nullptr;
    check_cycle(source_, top_.pointer_to("cycle"), problems_);
    return *value;
  }

  // Checks the baseline's name against the algorithms, including home and random.
  Json cost(const Suite& suite) {
    const Json* value = top_.get("cost");
    if (!value) return nullptr;
    const std::string pointer = top_.pointer_to("cost");
    const std::size_t mistakes = problems_.size();
    check_cost(source_, pointer, problems_);
    if (problems_.size() == mistakes && value->contains("baseline"))
      check_method_name(suite, (*value)["baseline"].get<std::string>(), pointer + "/baseline");
    return *value;
  }

  void check_method_name(const Suite& suite, const std::string& name, const std::string& pointer) {
    std::vector<std::string> names(kBaselines.begin(), kBaselines.end());
    for (const AlgorithmEntry& entry : suite.algorithms) names.push_back(entry.name);
    if (std::find(names.begin(), names.end(), name) != names.end()) return;
    const std::string nearest = nearest_name(name, names);
    complain(pointer, "unknown algorithm '" + name + "' in this suite" +
                          (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
  }

  Json spec() {
    const Json* value = top_.get("spec");
    if (!value) return nullptr;
    check_specification(source_, top_.pointer_to("spec"), problems_);
    return *value;
  }

  std::vector<double> targets() {
    constexpr std::size_t kMaxTargets = 1000;
    const Json* value = top_.get("targets");
    if (!value) return {};
    std::vector<double> targets;
    if (value->is_array())
      for (const Json& one : *value)
        if (one.is_number()) targets.push_back(one.get<double>());
    const bool falling = std::adjacent_find(targets.begin(), targets.end(), std::less_equal<>()) == targets.end();
    if (!value->is_array() || value->empty() || value->size() > kMaxTargets || targets.size() != value->size() ||
        !falling || !(targets.back() > 0) || !(targets.front() <= 1))
      top_.complain("targets", "expected a descending list of 1 to " + std::to_string(kMaxTargets) +
                                   " RMSE targets between 0 and 1, for example [0.02, 0.01, 0.005]");
    return targets;
  }

  // Adds home and random under every protocol in use, so that every table shows the result of one move to the nominal
  // pose and that of chance.
  void add_baselines(Suite& suite) {
    std::vector<std::string> protocols;
    for (const AlgorithmEntry& entry : suite.algorithms)
      if (std::find(protocols.begin(), protocols.end(), entry.protocol) == protocols.end())
        protocols.push_back(entry.protocol);
    const std::vector<std::string> known = catalog_.ids(plugin_host::Kind::optimizer);
    for (const std::string& protocol : protocols) {
      for (const std::string id : kBaselines) {
        const auto same = [&](const AlgorithmEntry& entry) {
          return entry.protocol == protocol && (entry.choice.plugin->id == id || entry.name == id);
        };
        if (std::any_of(suite.algorithms.begin(), suite.algorithms.end(), same)) continue;
        if (std::find(known.begin(), known.end(), id) == known.end()) continue;
        AlgorithmEntry entry;
        entry.choice = catalog_.resolve_or_throw(plugin_host::Kind::optimizer, id);
        entry.name = entry.choice.id;
        entry.protocol = protocol;
        entry.steps = defaults_.steps;
        entry.added = true;
        suite.algorithms.push_back(std::move(entry));
      }
    }
  }

  const JsonSource& source_;
  std::filesystem::path relative_to_;
  plugin_host::Catalog& catalog_;
  std::vector<Problem> problems_;
  ObjectReader top_;
  Defaults defaults_;
};

}  // namespace

Suite read_suite(const std::filesystem::path& file, plugin_host::Catalog& catalog) {
  const JsonSource source = JsonSource::from_file(file);
  return read_suite(source, file.parent_path(), catalog);
}

Suite read_suite(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog) {
  return SuiteReader(source, relative_to, catalog).read();
}

Json analysis_json(const Json& written) {
  if (!written.is_object()) return nullptr;
  return {{"primary", written.value("primary", "rmse")},
          {"rule", written.value("rule", "own")},
          {"contrasts", written.value("contrasts", Json::array())},
          {"smallest_relevant_ratio", written.value("smallest_relevant_ratio", kRelevantRatio)},
          {"yield", written.value("yield", Json())}};
}

Json machine_time_json(const MachineTimeKeys& times) {
  Json json = Json::object();
  const auto add = [&json](const char* key, const std::optional<double>& value) {
    if (value) json[key] = *value;
  };
  add("speed_mm_per_s", times.speed_mm_per_s);
  add("speed_deg_per_s", times.speed_deg_per_s);
  add("settle_ms", times.settle_ms);
  add("exposure_ms", times.exposure_ms);
  add("readout_ms", times.readout_ms);
  return json;
}

}  // namespace relign::suites
