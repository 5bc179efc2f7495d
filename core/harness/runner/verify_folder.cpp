#include "runner/verify_folder.h"

#include <algorithm>

#include "base/error.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/text.h"
#include "plugin_host/choice_json.h"
#include "records/manifest_check.h"
#include "records/processor.h"
#include "records/results_folder.h"
#include "runner/provenance.h"

namespace relign::runner {
namespace {

// The folder itself, or the folders that it was merged from.
std::vector<Json> sources_of(const Json& manifest) {
  const Json& sources = list_of(manifest, "sources");
  if (!sources.empty()) return {sources.begin(), sources.end()};
  return {manifest};
}

std::string shortened(const std::string& hash) { return hash.substr(0, 16); }

}  // namespace

std::vector<StoredSuite> suites_of(const Json& manifest) {
  std::vector<StoredSuite> suites;
  for (const Json& suite : list_of(manifest, "suites"))
    suites.push_back({text_of(suite, "text"), text_of(suite, "file"), text_of(suite, "name")});
  if (suites.empty())
    suites.push_back({text_of(manifest, "suite"), text_of(manifest, "suite_file"), text_of(manifest, "suite_name")});
  for (StoredSuite& suite : suites) suite.secret = text_of(manifest, "secret");
  return suites;
}

std::vector<ChosenTrial> choose_trials(const VerifyOptions& options, const Json& manifest, VerifySummary& summary) {
  std::set<std::string> planned, stations, seen;
  for (const Json& id : list_of(manifest, "order")) planned.insert(id.is_string() ? id.get<std::string>() : "");
  for (const Json& scene : list_of(manifest, "scenes"))
    if (scene.value("owns_stage", false)) stations.insert(text_of(scene, "name"));
  struct Candidate {
    std::string rank;
    ChosenTrial trial;
  };
  std::map<std::string, std::vector<Candidate>> by_algorithm;
  std::size_t count = 0;
  records::for_each_with_steps(  // since records without checksum are damaged where their steps cannot be read
      options.results,
      [&](const records::TrialRecord& closing, const records::StoredTrial& where,
          const std::vector<records::StepNumbers>&) {
        if (!options.trial.empty() && closing.trial != options.trial) return;
        if (options.add_rules && !records::lacks_rules(closing)) return;
        if ((!planned.empty() && !planned.count(closing.trial)) || !seen.insert(closing.trial).second) return;
        ++summary.recorded;
        const bool of_itself = records::ended_well(closing.end) || closing.end == "failed";
        if (stations.count(closing.scene))
          ++summary.stations;
        else if (!of_itself)
          ++summary.ended_by_machine;
        else {
          const std::string rank =
              options.sample == 0 ? "" : sha256_hex(std::to_string(options.seed) + " " + closing.trial);
          by_algorithm[options.sample == 0 ? "" : closing.algorithm + "\n" + closing.protocol].push_back(
              {rank, {closing.trial, where}});
          ++count;
        }
      },
      {}, &summary.damaged);
  if (options.trial.empty() && !options.add_rules && planned.size() > summary.recorded)
    summary.missing = planned.size() - summary.recorded;
  for (const records::Damage& damage : summary.damaged)
    if (!options.trial.empty() && damage.trial == options.trial) records::throw_if_damaged({damage});
  if (!options.trial.empty() && summary.recorded == 0)
    throw Error(ErrorKind::bad_input, "--trial " + options.trial + ": " + options.results.string() +
                                          " has no complete trial of this id; instances.csv lists them");
  if (!options.trial.empty() && count == 0)
    throw Error(ErrorKind::bad_input,
                "--trial " + options.trial + ": cannot be replayed, because " +
                    (summary.stations > 0 ? "it ran on a station" : "it was ended by a crash or a limit"));
  for (auto& [algorithm, candidates] : by_algorithm)
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; });
  std::vector<ChosenTrial> chosen;
  const std::size_t wanted = options.sample == 0 ? count : std::min(options.sample, count);
  for (std::size_t turn = 0; chosen.size() < wanted; ++turn)
    for (auto& [algorithm, candidates] : by_algorithm)
      if (turn < candidates.size() && chosen.size() < wanted) chosen.push_back(std::move(candidates[turn].trial));
  return chosen;
}

bool made_on_another_processor(const Json& manifest) {
  const Json here = machine_json();
  for (const Json& source : sources_of(manifest))
    if (!records::same_processor(member(source, "machine"), here)) return true;
  return false;
}

void compare_machines(const Json& manifest, std::set<Change>& changes) {
  const Json program = program_json(), machine = machine_json();
  for (const Json& source : sources_of(manifest)) {
    for (const char* key : {"version", "compiler", "flags", "hash"})
      if (const std::string was = text_of(member(source, "program"), key); was != text_of(program, key))
        changes.insert({std::string("program ") + key, key[0] == 'h' ? shortened(was) : was,
                        key[0] == 'h' ? shortened(text_of(program, key)) : text_of(program, key)});
    const Json& there = member(source, "machine");
    if (records::same_processor(there, machine)) continue;
    const bool names = text_of(there, "instruction_sets").empty();
    const char* key = names ? "cpu" : "instruction_sets";
    changes.insert({names ? "CPU" : "CPU's instruction sets", text_of(there, key), text_of(machine, key)});
  }
}

void require_plans_of_suites(const Json& manifest, const std::vector<PreparedPlan>& plans,
                             const std::filesystem::path& folder) {
  if (plans.empty()) return;
  std::set<std::string> found, planned;
  std::map<std::pair<std::string, std::string>, const Json*> recorded;
  for (const Json& entry : list_of(manifest, "algorithms"))
    recorded[{text_of(entry, "name"), text_of(entry, "protocol")}] = &entry;
  for (const PreparedPlan& prepared : plans) {
    const std::vector<suites::AlgorithmEntry>& algorithms = prepared.plan.suite.algorithms;
    std::vector<bool> listed;
    for (const suites::AlgorithmEntry& algorithm : algorithms) {
      const std::string name = in_quotes(algorithm.name) + " (protocol " + algorithm.protocol + ")";
      const auto entry = recorded.find({algorithm.name, algorithm.protocol});
      listed.push_back(entry != recorded.end());
      if (!listed.back()) {
        // Which baselines are added depends on what is installed.
        if (!algorithm.added) found.insert("the suite has the method " + name + ", the manifest does not");
        continue;
      }
      const Json observes = algorithm.choice.plugin->observes;
      if (const Json& stated = member(*entry->second, "observes"); !stated.is_null() && stated != observes)
        found.insert(name + " observes " + stated.dump() + " by the manifest and " + observes.dump() +
                     " by its plugin");
      const auto compare = [&](const char* key, const Json& own) {
        if (const Json& stated = member(*entry->second, key); !stated.is_null() && stated != own)
          found.insert(in_quotes(key) + " of " + name + " is " + stated.dump() + " in the manifest, but " + own.dump() +
                       " by its suite");
      };
      compare("oracle", suites::is_oracle(algorithm));
      compare("merit", suites::effective_merit(algorithm));
      compare("steps", algorithm.steps);
    }
    for (const suites::PlannedTrial& trial : prepared.plan.trials)
      if (listed[trial.algorithm]) planned.insert(trial.id);
  }
  // Other ids, but as many, mean changed plugins or data, which replays report.
  const Json& order = list_of(manifest, "order");
  const bool is_shard = manifest.contains("shard");
  if (is_shard ? order.size() > planned.size() : order.size() != planned.size())
    found.insert("the suite plans " + counted(planned.size(), "trial") + ", but 'order' has " +
                 std::to_string(order.size()));
  const suites::Suite& first = plans.front().plan.suite;
  using Number = std::pair<const char*, std::uint64_t>;
  for (const auto& [key, value] : {Number("seed", first.seed), Number("instances", first.instances),
                                   Number("first_instance", first.first_instance)})
    if (manifest.contains(key) && count_of(manifest, key) != value)
      found.insert(in_quotes(key) + " is " + std::to_string(count_of(manifest, key)) + ", but that of the suite is " +
                   std::to_string(value));
  const std::string stated = text_of(manifest, "instance_set"), own = plans.front().plan.instance_set;
  const bool same_trials = std::all_of(order.begin(), order.end(), [&planned](const Json& id) {
    return id.is_string() && planned.count(id.get<std::string>()) > 0;
  });
  if (same_trials && stated != own)
    found.insert("'instance_set' is " + in_quotes(stated) + ", but that of the suite is " + in_quotes(own));
  records::refuse_contradictions({found.begin(), found.end()}, folder);
}

void compare_definitions(const Json& manifest, const PreparedPlan& prepared, std::set<Change>& changes) {
  const suites::Suite& suite = prepared.plan.suite;
  const auto compare = [&](const char* key, const std::string& what, const std::string& name,
                           const plugin_host::Choice& choice, const std::string& protocol) {
    const Json parameters = plugin_host::recorded_parameters(choice);
    for (const Json& entry : list_of(manifest, key)) {
      if (text_of(entry, "name") != name || (!protocol.empty() && text_of(entry, "protocol") != protocol)) continue;
      if (member(entry, "parameters") != parameters)
        changes.insert({what + " " + name + " parameters", member(entry, "parameters").dump(), parameters.dump()});
    }
  };
  for (std::size_t index = 0; index < suite.scenes.size(); ++index) {
    const std::string& name = suite.scenes[index].name;
    compare("scenes", "scene", name, suite.scenes[index].choice, "");
    for (const Json& entry : list_of(manifest, "scenes"))
      if (const std::string was = member(entry, "data").dump();
          text_of(entry, "name") == name && was != prepared.scene_identity[index])
        changes.insert({"scene " + name + " data files", was, prepared.scene_identity[index]});
  }
  for (const suites::LevelEntry& level : suite.levels)
    compare("noise_levels", "noise level", level.name, level.choice, "");
  for (const suites::AlgorithmEntry& algorithm : suite.algorithms)
    compare("algorithms", "algorithm", algorithm.name, algorithm.choice, algorithm.protocol);
}

}  // namespace relign::runner
