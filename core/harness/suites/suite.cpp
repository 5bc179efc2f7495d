#include "suites/suite.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "base/baselines.h"
#include "base/json_members.h"
#include "base/limits.h"
#include "base/own_command.h"
#include "base/schema.h"
#include "base/text.h"
#include "suites/entries.h"
#include "suites/secret.h"

extern "C" {
extern const unsigned char relign_schema_suite[];
extern const unsigned long relign_schema_suite_size;
}

namespace relign::suites {
namespace {

class SuiteReader {
 public:
  SuiteReader(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog)
      : source_(source), relative_to_(relative_to), catalog_(catalog), top_(source, "", problems_) {}

  Suite read() {
    Suite suite;
    suite.file = source_.file();
    suite.text = source_.text();
    throw_if_any(problems_);  // not an object
    static const Schema schema(relign_schema_suite, relign_schema_suite_size);
    const Json file = schema.checked(source_, problems_);
    suite.name = file.value("name", std::filesystem::path(source_.file()).stem().string());
    if (const std::string mistake = name_mistake(suite.name);
        member(source_.root(), "name") == suite.name && !mistake.empty())
      top_.complain("name", mistake);
    suite.seed = file["seed"];
    suite.commitment = text_of(file, "commitment");
    if (member(source_.root(), "commitment").is_string() && !is_commitment(suite.commitment))
      top_.complain("commitment",
                    "expected \"sha256:\" and 64 hexadecimal digits, as '" + own_command("seal") + "' prints it");
    suite.instances = file["instances"];
    suite.first_instance = file["first_instance"];
    defaults_.steps = file["steps"];
    defaults_.protocols = read_protocols(top_, defaults_.protocols);
    suite.limits = file["limits"];
    EntryReader entries(source_, relative_to_, catalog_, defaults_, problems_);
    for (Entry& entry : entries.read(top_, "scenes", plugin_host::Kind::scene))
      suite.scenes.push_back({std::move(entry.name), std::move(entry.choice)});
    for (Entry& entry : entries.read(top_, "noise_levels", plugin_host::Kind::noise_level))
      suite.levels.push_back({std::move(entry.name), std::move(entry.choice)});
    for (Entry& entry : entries.read(top_, "algorithms", plugin_host::Kind::optimizer)) {
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
    suite.trial_seconds = file["trial_seconds"];
    suite.trial_memory_mb = file.value("trial_memory_mb", 0U);
    suite.machine_time = machine_time();
    suite.cycle = stated<CycleTimes>(file, "cycle");
    suite.cost = stated<Prices>(file, "cost");
    if (suite.cost && !suite.cost->baseline.empty()) check_method_name(suite, suite.cost->baseline, "/cost/baseline");
    suite.spec = spec();
    suite.targets = targets();
    suite.analysis = stated<AnalysisPlan>(file, "analysis");
    if (suite.analysis) check_contrasts(suite, suite.analysis->contrasts);
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

  // Names of contrasts may be those of home and random, too.
  // Of a document that its schema has checked.
  template <class T>
  std::optional<T> stated(const Json& file, const char* key) const {
    const Json& json = member(file, key);
    return json.is_null() ? std::nullopt : std::optional(read_described<T>(json, source_.file()));
  }

  void check_contrasts(const Suite& suite, const std::vector<std::array<std::string, 2>>& contrasts) {
    for (std::size_t i = 0; i < contrasts.size(); ++i)
      for (std::size_t side = 0; side < 2; ++side)
        check_method_name(suite, contrasts[i][side],
                          "/analysis/contrasts/" + std::to_string(i) + "/" + std::to_string(side));
  }

  MachineTimeKeys machine_time() {
    if (!top_.get("machine_time")) return {};
    return read_machine_time(source_, top_.pointer_to("machine_time"), problems_);
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
        !falling || !(targets.back() > 0))
      top_.complain("targets", "expected a descending list of 1 to " + std::to_string(kMaxTargets) +
                                   " targets above 0 for the score, for example [0.02, 0.01, 0.005]");
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
  EntryDefaults defaults_;
};

}  // namespace

Suite read_suite(const std::filesystem::path& file, plugin_host::Catalog& catalog) {
  const JsonSource source = JsonSource::from_file(file);
  return read_suite(source, file.parent_path(), catalog);
}

Suite read_suite(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog) {
  return SuiteReader(source, relative_to, catalog).read();
}

}  // namespace relign::suites
