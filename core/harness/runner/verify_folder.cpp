#include "runner/verify_folder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "base/error.h"
#include "base/hash.h"
#include "base/text.h"
#include "plugin_host/catalog.h"
#include "records/results_folder.h"
#include "runner/frozen_plan.h"
#include "runner/provenance.h"

namespace relign::runner {
namespace {

std::string shortened(const std::string& hash) { return hash.substr(0, 16); }

// The manifest that a run of the plan would write now.
records::Manifest manifest_now(const PreparedPlan& prepared) {
  return make_manifest(prepared, hash_libraries(prepared.plan.suite), "", {});
}

// Without files, whose names depend on where they are.
Json numbers_of(const plugin_host::Choice& choice, Json parameters) {
  for (const plugin_host::Parameter& parameter : choice.plugin->parameters)
    if (parameter.type == plugin_host::ParameterType::file && parameters.is_object()) parameters.erase(parameter.name);
  return parameters;
}

// A trial's id is a hash of its scene, noise level and method, so that the manifest cannot describe those of the
// folder's trials otherwise than a run would now, whatever build of the plugins made them.
class EntriesOfTrials {
 public:
  EntriesOfTrials(std::set<std::string>& found, const records::Manifest& manifest, const PreparedPlan& prepared)
      : found_(found), manifest_(manifest), suite_(prepared.plan.suite), now_(manifest_now(prepared)) {
    const std::set<std::string> order(manifest.order.begin(), manifest.order.end());
    for (const suites::PlannedTrial& trial : prepared.plan.trials) {
      if (!order.count(trial.id)) continue;
      scenes_.insert(trial.scene);
      levels_.insert(trial.level);
      methods_.insert(trial.algorithm);
    }
  }

  // `merged`: a method may be of the list of one suite only.
  void compare(bool merged) {
    for (const std::size_t index : scenes_)
      if (const records::ManifestScene* own = &now_.scenes[index],
          *stated = records::entry_with_key(manifest_.scenes, own->key());
          stated) {
        compare_plugins("scene", *stated, *own, suite_.scenes[index].choice);
        compare_members("scene", *stated, *own, {"data", "spec", "owns_stage", "truth", "replayable"});
        MachineTimeKeys::members(
            [&](const Member& member, const auto& is, const auto& due) {
              differs("scene", own->name, "machine_time/" + std::string(member.key), json_of(is), json_of(due));
            },
            stated->machine_time, own->machine_time);
      }
    for (const std::size_t index : levels_)
      if (const records::ManifestLevel* own = &now_.noise_levels[index],
          *stated = records::entry_with_key(manifest_.noise_levels, own->key());
          stated)
        compare_plugins("noise level", *stated, *own, suite_.levels[index].choice);
    for (const std::size_t index : methods_)
      if (const records::ManifestMethod* own = &now_.algorithms[index],
          *stated = records::entry_with_key(manifest_.algorithms, own->key());
          stated) {
        compare_plugins("algorithm", *stated, *own, suite_.algorithms[index].choice);
        if (!merged) compare_members("algorithm", *stated, *own, {"of_list"});
        if (stated->added) compare_members("algorithm", *stated, *own, {"added"});
      }
  }

 private:
  void differs(const std::string& noun, const std::string& name, const std::string& key, const Json& stated,
               const Json& own) {
    if (stated != own)
      found_.insert("'" + key + "' of the " + noun + " '" + name + "' is " + stated.dump() + " in the manifest, but " +
                    own.dump() + " by its trials");
  }
  template <class Entry>
  void compare_members(const std::string& noun, const Entry& stated, const Entry& own,
                       const std::vector<std::string_view>& keys) {
    for_each_differing(stated, own, keys, [&](const std::string& key, const Json& is, const Json& due) {
      differs(noun, own.name, key, is, due);
    });
  }
  void compare_plugins(const std::string& noun, const records::PluginEntry& stated, const records::PluginEntry& own,
                       const plugin_host::Choice& choice) {
    differs(noun, own.name, "parameters", numbers_of(choice, stated.parameters), numbers_of(choice, own.parameters));
    compare_members(noun, stated, own, {"plugin", "kind"});
  }

  std::set<std::string>& found_;
  const records::Manifest& manifest_;
  const suites::Suite& suite_;
  const records::Manifest now_;
  std::set<std::size_t> scenes_, levels_, methods_;
};

// The methods of the suites, and no others, those of the first in its order.
void require_methods_of_suites(std::set<std::string>& found, const records::Manifest& manifest,
                               const std::vector<PreparedPlan>& plans) {
  std::set<std::pair<std::string, std::string>> planned;
  std::map<std::pair<std::string, std::string>, std::size_t> places;
  for (const PreparedPlan& prepared : plans)
    for (const suites::AlgorithmEntry& one : prepared.plan.suite.algorithms) planned.insert({one.name, one.protocol});
  for (const records::ManifestMethod& method : manifest.algorithms) {
    places.emplace(std::pair(method.name, method.protocol), places.size());
    if (!planned.count({method.name, method.protocol}) && !method.added)
      found.insert("the manifest has the method " + method.label() + ", the suite does not");
  }
  std::vector<std::size_t> order;
  for (const suites::AlgorithmEntry& one : plans.front().plan.suite.algorithms)
    if (const auto place = places.find({one.name, one.protocol}); !one.added && place != places.end())
      order.push_back(place->second);
  if (!std::is_sorted(order.begin(), order.end()))
    found.insert("the manifest has the methods in another order than the suite");
}

// Whether the trials that both have follow each other equally.
bool in_order(const std::vector<std::string>& order, const std::vector<suites::PlannedTrial>& trials) {
  std::unordered_map<std::string, std::size_t> places;
  for (const suites::PlannedTrial& trial : trials) places.emplace(trial.id, places.size());
  std::size_t next = 0;
  for (const std::string& id : order) {
    const auto found = places.find(id);
    if (found == places.end()) continue;
    if (found->second < next) return false;
    next = found->second + 1;
  }
  return true;
}

}  // namespace

std::size_t trials_of_no_plan(const records::Manifest& manifest, const std::vector<PreparedPlan>& plans) {
  std::set<std::string> planned;
  for (const PreparedPlan& prepared : plans)
    for (const suites::PlannedTrial& trial : prepared.plan.trials) planned.insert(trial.id);
  return static_cast<std::size_t>(std::count_if(manifest.order.begin(), manifest.order.end(),
                                                [&](const std::string& id) { return planned.count(id) == 0; }));
}

std::vector<ChosenTrial> choose_trials(const VerifyOptions& options, const records::Manifest& manifest,
                                       VerifySummary& summary, records::FolderChecks& checks) {
  const std::set<std::string> planned(manifest.order.begin(), manifest.order.end());
  std::set<std::string> stations, seen;
  for (const records::ManifestScene& scene : manifest.scenes)
    if (scene.owns_stage) stations.insert(scene.name);
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

bool made_on_another_processor(const records::Manifest& manifest) {
  const std::vector<const records::Machine*> machines = manifest.machines();
  const records::Machine here = this_machine();
  return !std::all_of(machines.begin(), machines.end(), [&here](const auto* one) { return one->same_processor(here); });
}

void compare_machines(const records::Manifest& manifest, std::set<Change>& changes) {
  const records::Program program = this_program();
  const records::Machine machine = this_machine();
  for (const records::Program& build : manifest.builds())
    records::Program::members(
        [&changes](const Member& member, const std::string& was, const std::string& is) {
          const bool hash = member.key == "hash";
          if (was != is)
            changes.insert(
                {"program " + std::string(member.key), hash ? shortened(was) : was, hash ? shortened(is) : is});
        },
        build, program);
  for (const records::Machine* there : manifest.machines()) {
    if (there->same_processor(machine)) continue;
    if (there->instruction_sets.empty())
      changes.insert({"CPU", there->cpu, machine.cpu});
    else
      changes.insert({"CPU's instruction sets", there->instruction_sets, machine.instruction_sets});
  }
}

namespace {

// How many of the planned trials the manifest must list: those of its shard, or of the merged ones. Unknown for several
// suites.
std::optional<std::size_t> planned_trials(const records::Manifest& manifest, const std::vector<PreparedPlan>& plans,
                                          const std::set<std::string>& planned) {
  if (plans.size() != 1) return std::nullopt;
  const suites::Plan& plan = plans.front().plan;
  std::set<std::string> listed;
  std::vector<std::optional<records::Shard>> shards;
  for (const records::MergeSource& source : manifest.sources) shards.push_back(source.shard);
  if (shards.empty()) shards.push_back(manifest.shard);
  for (const std::optional<records::Shard>& shard : shards) {
    if (!shard || shard->of > plan.trials.size() || shard->number >= shard->of) return planned.size();
    for (const std::size_t place :
         places_of_shard(plan, static_cast<unsigned>(shard->number), static_cast<unsigned>(shard->of)))
      if (const std::string& id = plan.trials[place].id; planned.count(id)) listed.insert(id);
  }
  return listed.size();
}

// A member that is missing is read as another value, such as an oracle as an ordinary method.
void compare_method(std::set<std::string>& found, const records::ManifestMethod& stated,
                    const suites::AlgorithmEntry& own) {
  if (stated.observes != own.choice.plugin->observes)
    found.insert(stated.label() + " observes " + Json(stated.observes).dump() + " by the manifest and " +
                 Json(own.choice.plugin->observes).dump() + " by its plugin");
  const auto compare = [&](const char* key, const Json& is, const Json& due) {
    if (is != due)
      found.insert(in_quotes(key) + " of " + stated.label() + " is " + is.dump() + " in the manifest, but " +
                   due.dump() + " by its suite");
  };
  compare("oracle", stated.oracle, suites::is_oracle(own));
  compare("merit", stated.merit, suites::effective_merit(own));
  compare("steps", stated.steps, own.steps);
}

}  // namespace

std::vector<std::string> plan_contradictions(const records::Manifest& manifest,
                                             const std::vector<PreparedPlan>& plans) {
  if (plans.empty()) return {};
  std::set<std::string> found, planned;
  for (const PreparedPlan& prepared : plans) {
    std::vector<bool> listed;
    for (const suites::AlgorithmEntry& algorithm : prepared.plan.suite.algorithms) {
      const records::ManifestMethod* stated = manifest.method(algorithm.name, algorithm.protocol);
      listed.push_back(stated != nullptr);
      if (stated)
        compare_method(found, *stated, algorithm);
      else if (!algorithm.added)  // which baselines are added depends on what is installed
        found.insert("the suite has the method " + in_quotes(algorithm.name) + " (protocol " + algorithm.protocol +
                     "), the manifest does not");
    }
    for (const suites::PlannedTrial& trial : prepared.plan.trials)
      if (listed[trial.algorithm]) planned.insert(trial.id);
    EntriesOfTrials(found, manifest, prepared).compare(plans.size() > 1);
  }
  require_methods_of_suites(found, manifest, plans);
  // Other ids, but as many, mean changed plugins or data, which replays report.
  const std::vector<std::string>& order = manifest.order;
  if (const std::optional<std::size_t> wanted = planned_trials(manifest, plans, planned);
      wanted ? order.size() != *wanted : order.size() > planned.size())
    found.insert("the suite plans " + counted(wanted.value_or(planned.size()), "trial") + ", but 'order' has " +
                 std::to_string(order.size()));
  const suites::Plan& first = plans.front().plan;
  if (const Json is = json_of(manifest.analysis), due = json_of(first.suite.analysis);
      plans.size() == 1 && manifest.analysis && is != due)
    found.insert("the analysis plan is " + is.dump() + " in the manifest, but " + due.dump() + " by the suite");
  if (plans.size() == 1 && manifest.sources.empty() && !in_order(order, first.trials))
    found.insert("'order' lists the trials in another order than the plan");
  const auto compare = [&found](const char* key, std::uint64_t is, std::uint64_t due) {
    if (is != due)
      found.insert(in_quotes(key) + " is " + std::to_string(is) + ", but that of the suite is " + std::to_string(due));
  };
  compare("seed", manifest.seed, first.suite.seed);
  compare("instances", manifest.instances, first.suite.instances);
  compare("first_instance", manifest.first_instance, first.suite.first_instance);
  const bool same_trials =
      std::all_of(order.begin(), order.end(), [&planned](const std::string& id) { return planned.count(id) > 0; });
  if (same_trials && manifest.instance_set != first.instance_set)
    found.insert("'instance_set' is " + in_quotes(manifest.instance_set) + ", but that of the suite is " +
                 in_quotes(first.instance_set));
  return {found.begin(), found.end()};
}

void compare_definitions(const records::Manifest& manifest, const PreparedPlan& prepared, std::set<Change>& changes) {
  const records::Manifest now = manifest_now(prepared);
  const auto compare = [&]<class Entry>(const std::string& noun, const std::vector<Entry>& stated,
                                        const std::vector<Entry>& own,
                                        std::map<std::string, std::string> records::PluginHashesOfFolder::*merged) {
    for (const Entry& is : own) {
      const Entry* was = records::entry_with_key(stated, is.key());
      if (!was) continue;
      for_each_differing(
          *was, is, {"parameters", "data", "training"},
          [&](const std::string& key, const Json& before, const Json& after) {
            const char* what = key == "data" ? "data files" : key == "training" ? "cost of training" : "parameters";
            changes.insert({noun + " " + is.name + " " + what, before.dump(), after.dump()});
          });
      std::set<std::string> hashes = {was->plugin_hash};
      for (const records::MergeSource& source : manifest.sources)
        if (const auto found = (source.plugins.*merged).find(is.name); found != (source.plugins.*merged).end())
          hashes.insert(found->second);
      for (const std::string& hash : hashes)
        if (!hash.empty() && hash != is.plugin_hash)
          changes.insert({"plugin " + is.plugin, shortened(hash), shortened(is.plugin_hash)});
    }
  };
  compare("scene", manifest.scenes, now.scenes, &records::PluginHashesOfFolder::scenes);
  compare("noise level", manifest.noise_levels, now.noise_levels, &records::PluginHashesOfFolder::noise_levels);
  compare("algorithm", manifest.algorithms, now.algorithms, &records::PluginHashesOfFolder::algorithms);
}

}  // namespace relign::runner
