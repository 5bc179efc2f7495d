#include "runner/verify_folder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "base/error.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/text.h"
#include "plugin_host/catalog.h"
#include "records/manifest_check.h"
#include "records/processor.h"
#include "records/results_folder.h"
#include "runner/frozen_plan.h"
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

const std::map<std::string, std::string> kNouns = {
    {"scenes", "scene"}, {"noise_levels", "noise level"}, {"algorithms", "algorithm"}};
constexpr std::pair<const char*, const char*> kDefinitions[] = {
    {"parameters", "parameters"}, {"data", "data files"}, {"training", "cost of training"}};

// The entry of this name, and of a method under this protocol.
const Json& entry_like(const Json& list, const Json& other) {
  static const Json kNone;
  for (const Json& entry : list)
    if (text_of(entry, "name") == text_of(other, "name") && text_of(entry, "protocol") == text_of(other, "protocol"))
      return entry;
  return kNone;
}

// The manifest that a run of the plan would write now.
Json manifest_now(const PreparedPlan& prepared) {
  return make_manifest(prepared, hash_libraries(prepared.plan.suite), "", nullptr);
}

// Without files, whose names depend on where they are.
Json numbers_of(const plugin_host::Choice& choice, Json parameters) {
  for (const plugin_host::Parameter& parameter : choice.plugin->parameters)
    if (parameter.type == plugin_host::ParameterType::file && parameters.is_object()) parameters.erase(parameter.name);
  return parameters;
}

// A trial's id is a hash of its scene, noise level and method, so that the manifest cannot describe those of the
// folder's trials otherwise than a run would now, whatever build of the plugins made them.
void require_entries_of_trials(std::set<std::string>& found, const Json& manifest, const PreparedPlan& prepared,
                               bool merged) {
  const suites::Suite& suite = prepared.plan.suite;
  const std::set<std::string> order = records::ordered_ids(manifest);
  std::set<std::pair<std::string, std::size_t>> used;
  for (const suites::PlannedTrial& trial : prepared.plan.trials)
    if (order.count(trial.id))
      used.insert({{"scenes", trial.scene}, {"noise_levels", trial.level}, {"algorithms", trial.algorithm}});
  const Json now = manifest_now(prepared);
  for (const auto& [list, index] : used) {
    const plugin_host::Choice& choice = list == "scenes"         ? suite.scenes[index].choice
                                        : list == "noise_levels" ? suite.levels[index].choice
                                                                 : suite.algorithms[index].choice;
    const Json &own = now[list][index], &entry = entry_like(list_of(manifest, list.c_str()), own);
    if (entry.is_null()) continue;
    const auto compare = [&, &list = list](const char* key, const Json& stated, const Json& is) {
      if (stated != is)
        found.insert("'" + std::string(key) + "' of the " + kNouns.at(list) + " '" + text_of(own, "name") + "' is " +
                     stated.dump() + " in the manifest, but " + is.dump() + " by its trials");
    };
    compare("parameters", numbers_of(choice, member(entry, "parameters")),
            numbers_of(choice, member(own, "parameters")));
    for (const char* key : {"plugin", "data", "spec", "owns_stage", "truth"})
      compare(key, member(entry, key), member(own, key));
    for (const char* key : {"kind", "replayable"})
      if (entry.contains(key)) compare(key, entry[key], member(own, key));
    for (const auto& [key, stated] : object_of(entry, "machine_time").items())  // a later version may have more keys
      compare(("machine_time/" + key).c_str(), stated, member(member(own, "machine_time"), key.c_str()));
    if (!merged)
      compare("of_list", member(entry, "of_list"), member(own, "of_list"));  // else that of one of the suites
    if (flag_of(entry, "added")) compare("added", true, member(own, "added"));
  }
}

// The methods of the suites, and no others, those of the first in its order.
void require_methods_of_suites(std::set<std::string>& found, const Json& manifest,
                               const std::vector<PreparedPlan>& plans) {
  std::set<std::pair<std::string, std::string>> planned;
  std::map<std::pair<std::string, std::string>, std::size_t> places;
  for (const PreparedPlan& prepared : plans)
    for (const suites::AlgorithmEntry& one : prepared.plan.suite.algorithms) planned.insert({one.name, one.protocol});
  for (const Json& entry : list_of(manifest, "algorithms")) {
    const std::pair key(text_of(entry, "name"), text_of(entry, "protocol"));
    places.emplace(key, places.size());
    if (!planned.count(key) && !flag_of(entry, "added"))
      found.insert("the manifest has the method '" + key.first + "' (protocol " + key.second + "), the suite does not");
  }
  std::vector<std::size_t> order;
  for (const suites::AlgorithmEntry& one : plans.front().plan.suite.algorithms)
    if (const auto place = places.find({one.name, one.protocol}); !one.added && place != places.end())
      order.push_back(place->second);
  if (!std::is_sorted(order.begin(), order.end()))
    found.insert("the manifest has the methods in another order than the suite");
}

// Whether the trials that both have follow each other equally.
bool in_order(const Json& order, const std::vector<suites::PlannedTrial>& trials) {
  std::unordered_map<std::string, std::size_t> places;
  for (const suites::PlannedTrial& trial : trials) places.emplace(trial.id, places.size());
  std::size_t next = 0;
  for (const Json& id : order) {
    const auto found = id.is_string() ? places.find(id.get_ref<const std::string&>()) : places.end();
    if (found == places.end()) continue;
    if (found->second < next) return false;
    next = found->second + 1;
  }
  return true;
}

}  // namespace

std::size_t trials_of_no_plan(const Json& manifest, const std::vector<PreparedPlan>& plans) {
  std::set<std::string> planned;
  for (const PreparedPlan& prepared : plans)
    for (const suites::PlannedTrial& trial : prepared.plan.trials) planned.insert(trial.id);
  const std::set<std::string> order = records::ordered_ids(manifest);
  return static_cast<std::size_t>(
      std::count_if(order.begin(), order.end(), [&](const std::string& id) { return planned.count(id) == 0; }));
}

std::vector<StoredSuite> suites_of(const Json& manifest) {
  std::vector<StoredSuite> suites;
  for (const Json& suite : list_of(manifest, "suites"))
    suites.push_back({text_of(suite, "text"), text_of(suite, "file"), text_of(suite, "name")});
  if (suites.empty())
    suites.push_back({text_of(manifest, "suite"), text_of(manifest, "suite_file"), text_of(manifest, "suite_name")});
  for (StoredSuite& suite : suites) suite.secret = text_of(manifest, "secret");
  return suites;
}

std::vector<ChosenTrial> choose_trials(const VerifyOptions& options, const Json& manifest, VerifySummary& summary,
                                       records::FolderChecks& checks) {
  const std::set<std::string> planned = records::ordered_ids(manifest);
  std::set<std::string> stations, seen;
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
          const std::vector<records::StepNumbers>& steps) {
        checks.add(closing, steps);
        if (!options.trial.empty() && closing.trial != options.trial) return;
        if ((!planned.empty() && !planned.count(closing.trial)) || !seen.insert(closing.trial).second) return;
        ++summary.recorded;
        const bool of_itself = records::ended_well(closing.end) || closing.end == "failed";
        ++summary.methods[{closing.algorithm, closing.protocol}].recorded;
        if (stations.count(closing.scene)) {
          ++summary.stations;
        } else if (!of_itself)
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
  if (options.trial.empty() && planned.size() > summary.recorded) summary.missing = planned.size() - summary.recorded;
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
  for (const Json& build : records::builds_of(manifest))
    for (const char* key : {"version", "compiler", "flags", "hash"})
      if (const std::string was = text_of(build, key); was != text_of(program, key))
        changes.insert({std::string("program ") + key, key[0] == 'h' ? shortened(was) : was,
                        key[0] == 'h' ? shortened(text_of(program, key)) : text_of(program, key)});
  for (const Json& source : sources_of(manifest)) {
    const Json& there = member(source, "machine");
    if (records::same_processor(there, machine)) continue;
    const bool names = text_of(there, "instruction_sets").empty();
    const char* key = names ? "cpu" : "instruction_sets";
    changes.insert({names ? "CPU" : "CPU's instruction sets", text_of(there, key), text_of(machine, key)});
  }
}

namespace {

// How many of the planned trials the manifest must list: those of its shard, or of the merged ones. Unknown for several
// suites.
std::optional<std::size_t> planned_trials(const Json& manifest, const std::vector<PreparedPlan>& plans,
                                          const std::set<std::string>& planned) {
  if (plans.size() != 1) return std::nullopt;
  const suites::Plan& plan = plans.front().plan;
  std::set<std::string> listed;
  for (const Json& source : sources_of(manifest)) {
    const Json& shard = member(source, "shard");
    const std::uint64_t number = count_of(shard, "number"), of = count_of(shard, "of");
    if (!shard.is_object() || of == 0 || of > plan.trials.size() || number >= of) return planned.size();
    for (const std::size_t place : places_of_shard(plan, static_cast<unsigned>(number), static_cast<unsigned>(of)))
      if (const std::string& id = plan.trials[place].id; planned.count(id)) listed.insert(id);
  }
  return listed.size();
}

}  // namespace

std::vector<std::string> plan_contradictions(const Json& manifest, const std::vector<PreparedPlan>& plans) {
  if (plans.empty()) return {};
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
      // A member that is missing is read as another value, such as an oracle as an ordinary method.
      const Json observes = algorithm.choice.plugin->observes;
      if (const Json& stated = member(*entry->second, "observes"); stated != observes)
        found.insert(name + " observes " + stated.dump() + " by the manifest and " + observes.dump() +
                     " by its plugin");
      const auto compare = [&](const char* key, const Json& own) {
        if (const Json& stated = member(*entry->second, key); stated != own)
          found.insert(in_quotes(key) + " of " + name + " is " + stated.dump() + " in the manifest, but " + own.dump() +
                       " by its suite");
      };
      compare("oracle", suites::is_oracle(algorithm));
      compare("merit", suites::effective_merit(algorithm));
      compare("steps", algorithm.steps);
    }
    for (const suites::PlannedTrial& trial : prepared.plan.trials)
      if (listed[trial.algorithm]) planned.insert(trial.id);
    require_entries_of_trials(found, manifest, prepared, plans.size() > 1);
  }
  require_methods_of_suites(found, manifest, plans);
  // Other ids, but as many, mean changed plugins or data, which replays report.
  const Json& order = list_of(manifest, "order");
  if (const std::optional<std::size_t> wanted = planned_trials(manifest, plans, planned);
      wanted ? order.size() != *wanted : order.size() > planned.size())
    found.insert("the suite plans " + counted(wanted.value_or(planned.size()), "trial") + ", but 'order' has " +
                 std::to_string(order.size()));
  if (const Json& analysis = member(manifest, "analysis");
      plans.size() == 1 && !analysis.is_null() && analysis != plans.front().plan.suite.analysis)
    found.insert("the analysis plan is " + analysis.dump() + " in the manifest, but " +
                 plans.front().plan.suite.analysis.dump() + " by the suite");
  if (plans.size() == 1 && list_of(manifest, "sources").empty() && !in_order(order, plans.front().plan.trials))
    found.insert("'order' lists the trials in another order than the plan");
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
  return {found.begin(), found.end()};
}

void compare_definitions(const Json& manifest, const PreparedPlan& prepared, std::set<Change>& changes) {
  const Json now = manifest_now(prepared);
  for (const auto& [list, noun] : kNouns)
    for (const Json& is : now[list]) {
      const Json& was = entry_like(list_of(manifest, list.c_str()), is);
      if (was.is_null()) continue;
      const std::string name = text_of(is, "name"), own = text_of(is, "plugin_hash");
      for (const auto& [key, what] : kDefinitions)
        if (const Json& before = member(was, key), &after = member(is, key); before != after)
          changes.insert({noun + " " + name + " " + what, before.dump(), after.dump()});
      std::set<std::string> hashes = {text_of(was, "plugin_hash")};
      for (const Json& source : list_of(manifest, "sources"))
        hashes.insert(text_of(member(member(source, "plugins"), list.c_str()), name.c_str()));
      for (const std::string& hash : hashes)
        if (!hash.empty() && hash != own)
          changes.insert({"plugin " + text_of(is, "plugin"), shortened(hash), shortened(own)});
    }
}

}  // namespace relign::runner
