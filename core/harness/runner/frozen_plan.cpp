#include "runner/frozen_plan.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "base/files.h"
#include "base/hash.h"
#include "base/own_command.h"
#include "base/text.h"
#include "records/record.h"
#include "runner/provenance.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kIdSize = 16;  // of a trial

using Instance = std::tuple<std::size_t, std::size_t, std::uint64_t>;  // scene, level, number

Instance instance_of(const suites::PlannedTrial& trial) { return {trial.scene, trial.level, trial.instance}; }

std::size_t count_instances(const suites::Plan& plan) {
  std::set<Instance> instances;
  for (const suites::PlannedTrial& trial : plan.trials) instances.insert(instance_of(trial));
  return instances.size();
}

// One string has all ids of one algorithm on one scene and noise level: a million trials take 16 MB.
std::vector<PlanBlock> blocks_of(const PreparedPlan& prepared) {
  const suites::Suite& suite = prepared.plan.suite;
  std::vector<PlanBlock> blocks;
  std::string ids;
  const std::vector<suites::PlannedTrial>& trials = prepared.plan.trials;
  for (std::size_t place = 0; place < trials.size(); ++place) {
    const suites::PlannedTrial& trial = trials[place];
    ids += trial.id;
    const bool last = place + 1 == trials.size() || trials[place + 1].scene != trial.scene ||
                      trials[place + 1].level != trial.level || trials[place + 1].algorithm != trial.algorithm;
    if (!last) continue;
    blocks.push_back({suite.scenes[trial.scene].name, suite.levels[trial.level].name,
                      suite.algorithms[trial.algorithm].name, suite.algorithms[trial.algorithm].protocol,
                      std::exchange(ids, "")});
  }
  return blocks;
}

// Hash of everything that determines the trials, their results and their shards.
std::string hash_of_plan(const FrozenPlan& plan) {
  Json content = json_of(plan);
  for (const char* key : {"format", "plan", "program", "suite_file", "suite_folder"}) content.erase(key);
  return short_hash(canonical_json(content));
}

// Why the ids are not those of `trials` trials in `shards` shards; empty if they are. The hash does not protect,
// because an edited file can have a new one.
std::string mistake_of_blocks(const FrozenPlan& plan) {
  std::uint64_t trials = 0;
  for (const PlanBlock& block : plan.blocks) {
    if (block.ids.empty() || block.ids.size() % kIdSize != 0) return "malformed ids of trials";
    trials += block.ids.size() / kIdSize;
  }
  if (trials != plan.trials)
    return "found " + std::to_string(trials) + " trials; expected " + std::to_string(plan.trials) + " by 'trials'";
  if (plan.shards > std::max<std::uint64_t>(plan.trials, 1))
    return std::to_string(plan.trials) + " trials in " + std::to_string(plan.shards) + " shards";
  return "";
}

// Appends a message on every difference between the entries of two lists, matched by name and protocol.
template <class Entry>
void compare_lists(const std::string& what, const std::vector<Entry>& was, const std::vector<Entry>& is,
                   std::vector<std::string>& changes) {
  for (const Entry& entry : was) {
    const Entry* now = records::entry_with_key(is, entry.key());
    if (!now) {
      changes.push_back(what + " '" + entry.name + "' was removed");
      continue;
    }
    for_each_differing(entry, *now, {"plugin", "plugin_hash", "identity", "data"},
                       [&](const std::string& member, const Json& before, const Json& after) {
                         changes.push_back(what + " '" + entry.name + "', " + member + ": was " + before.dump() +
                                           ", is " + after.dump());
                       });
  }
  for (const Entry& entry : is)
    if (!records::entry_with_key(was, entry.key())) changes.push_back(what + " '" + entry.name + "' was added");
}

}  // namespace

fs::path FrozenPlan::folder() const { return (fs::absolute(file).parent_path() / suite_folder).lexically_normal(); }

FrozenPlan freeze(const PreparedPlan& prepared, unsigned shards, const fs::path& folder, bool sandbox) {
  const suites::Suite& suite = prepared.plan.suite;
  const std::size_t instances = count_instances(prepared.plan);
  if (shards < 1 || shards > instances)
    throw Error(ErrorKind::bad_input, "--shards " + std::to_string(shards) + ": the suite can be split into 1 to " +
                                          std::to_string(instances) +
                                          " shards, one per instance of each scene and noise level");
  const LibraryHashes hashes = hash_libraries(suite);
  const auto entry_of = [&hashes](const std::string& name, const plugin_host::Choice& choice) {
    return PlanEntry{name, choice.plugin->id, hash_of(choice, hashes), suites::identity_json(choice.identity)};
  };
  FrozenPlan plan;
  plan.name = suite.name;
  plan.suite = suite.text;
  plan.suite_file = suite.file;
  plan.suite_folder = fs::weakly_canonical(fs::absolute(fs::path(suite.file)).parent_path())
                          .lexically_proximate(fs::weakly_canonical(fs::absolute(folder)))
                          .generic_string();
  plan.shards = shards;
  plan.sandbox = sandbox;
  plan.trials = prepared.plan.trials.size();
  plan.instance_set = prepared.plan.instance_set;
  plan.program = this_program();
  for (std::size_t index = 0; index < suite.scenes.size(); ++index)
    plan.scenes.push_back({entry_of(suite.scenes[index].name, suite.scenes[index].choice),
                           suites::identity_json(prepared.scene_identity[index])});
  for (const suites::LevelEntry& entry : suite.levels) plan.noise_levels.push_back(entry_of(entry.name, entry.choice));
  for (const suites::AlgorithmEntry& entry : suite.algorithms)
    plan.algorithms.push_back({entry_of(entry.name, entry.choice), entry.protocol});
  plan.blocks = blocks_of(prepared);
  plan.hash = hash_of_plan(plan);
  return plan;
}

FrozenPlan read_plan(const fs::path& file) {
  const Json content = parsed_json(read_file(file));
  const auto refuse = [&file](const std::string& why) {
    throw Error(ErrorKind::bad_input,
                file.string() + " " + why + "; make a plan with '" + own_command("plan SUITE -o FILE") + "'");
  };
  if (!content.is_object() || !content.contains("blocks") || !content.contains("format"))
    refuse("is not a plan (run a suite without --plan)");
  records::check_format(content, file.string());
  FrozenPlan plan;
  JsonFlaws flaws;
  JsonForm<FrozenPlan>::read({}, content, plan, flaws);
  if (flaws.any()) refuse("is damaged: " + flaws.text());
  if (const std::string mistake = mistake_of_blocks(plan); !mistake.empty()) refuse("is damaged: " + mistake);
  if (plan.hash != hash_of_plan(plan)) refuse("is damaged or was edited: its content does not match its hash");
  plan.file = file;
  return plan;
}

void check_unchanged(const FrozenPlan& frozen, const PreparedPlan& prepared) {
  const FrozenPlan now = freeze(prepared, frozen.shards, fs::absolute(frozen.file).parent_path(), frozen.sandbox);
  if (now.hash == frozen.hash) return;
  std::vector<std::string> changes;
  compare_lists("scene", frozen.scenes, now.scenes, changes);
  compare_lists("noise level", frozen.noise_levels, now.noise_levels, changes);
  compare_lists("algorithm", frozen.algorithms, now.algorithms, changes);
  if (changes.empty())
    changes.push_back("the list of trials: was " + std::to_string(frozen.trials) + ", is " +
                      std::to_string(prepared.plan.trials.size()) + ", or their ids changed");
  throw Error(ErrorKind::bad_input, frozen.file.string() + " was made with different plugins or data:\n  " +
                                        join(changes, "\n  ") + "\nrestore them, or make a new plan and start again");
}

std::vector<std::size_t> places_of_shard(const suites::Plan& plan, unsigned shard, unsigned shards) {
  std::map<Instance, std::size_t> number;  // in the order of the key: scene, level, instance
  for (const suites::PlannedTrial& trial : plan.trials) number.emplace(instance_of(trial), 0);
  std::size_t next = 0;
  for (auto& [instance, own] : number) own = next++;
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < plan.trials.size(); ++place)
    if (number.at(instance_of(plan.trials[place])) % shards == shard) places.push_back(place);
  return places;
}

std::vector<std::string> ids_of_shard(const FrozenPlan& plan, unsigned shard) {
  const auto place_of = [](const auto& entries, const std::string& name) {
    return static_cast<std::size_t>(
        std::find_if(entries.begin(), entries.end(), [&name](const PlanEntry& entry) { return entry.name == name; }) -
        entries.begin());
  };
  // The index of the first instance of each scene and noise level, in the order in which instances are dealt out.
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> first;
  std::vector<std::pair<std::pair<std::size_t, std::size_t>, std::string>> blocks;
  for (const PlanBlock& block : plan.blocks) {
    const std::pair key(place_of(plan.scenes, block.scene), place_of(plan.noise_levels, block.noise_level));
    blocks.emplace_back(key, block.ids);
    first[key] = blocks.back().second.size() / kIdSize;
  }
  std::size_t next = 0;
  for (auto& [key, count] : first) next += std::exchange(count, next);
  std::vector<std::string> ids;
  for (const auto& [key, text] : blocks) {
    const std::size_t behind = first.at(key) % plan.shards;
    for (std::size_t k = (shard + plan.shards - behind) % plan.shards; k < text.size() / kIdSize; k += plan.shards)
      ids.push_back(text.substr(k * kIdSize, kIdSize));
  }
  return ids;
}

}  // namespace relign::runner
