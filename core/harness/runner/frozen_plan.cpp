#include "runner/frozen_plan.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/own_command.h"
#include "base/text.h"
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

Json parsed(const std::string& json) {
  Json value = parsed_json(json);
  return value.is_discarded() ? Json(json) : value;
}

// One string has all ids of one algorithm on one scene and noise level: a million trials take 16 MB.
Json blocks_of(const PreparedPlan& prepared) {
  const suites::Suite& suite = prepared.plan.suite;
  Json blocks = Json::array();
  std::string ids;
  const std::vector<suites::PlannedTrial>& trials = prepared.plan.trials;
  for (std::size_t place = 0; place < trials.size(); ++place) {
    const suites::PlannedTrial& trial = trials[place];
    ids += trial.id;
    const bool last = place + 1 == trials.size() || trials[place + 1].scene != trial.scene ||
                      trials[place + 1].level != trial.level || trials[place + 1].algorithm != trial.algorithm;
    if (!last) continue;
    blocks.push_back({{"scene", suite.scenes[trial.scene].name},
                      {"noise_level", suite.levels[trial.level].name},
                      {"algorithm", suite.algorithms[trial.algorithm].name},
                      {"protocol", suite.algorithms[trial.algorithm].protocol},
                      {"ids", std::move(ids)}});
    ids.clear();
  }
  return blocks;
}

// Hash of everything that determines the trials, their results and their shards.
std::string hash_of_plan(Json content) {
  for (const char* key : {"format", "plan", "program", "suite_file", "suite_folder"}) content.erase(key);
  return short_hash(canonical_json(content));
}

// Checks the members of a plan file that this program relies on; returns a message, or an empty string. The hash is no
// protection, because an edited file can have a new hash.
std::string mistake_of_lists(const Json& content) {
  const auto is_object = [](const Json& entry) { return entry.is_object(); };
  for (const char* key : {"scenes", "noise_levels", "algorithms", "blocks"})
    if (!content.contains(key) || !content[key].is_array() ||
        !std::all_of(content[key].begin(), content[key].end(), is_object))
      return std::string("expected a list of objects '") + key + "'";
  const auto program = content.find("program");
  if (program == content.end() || !program->is_object() || !program->contains("hash") ||
      !(*program)["hash"].is_string())
    return "expected 'program' with the hash of the program that made it";
  std::uint64_t trials = 0;
  for (const Json& block : content["blocks"]) {
    const std::string ids = text_of(block, "ids");
    if (ids.empty() || ids.size() % kIdSize != 0) return "malformed ids of trials";
    trials += ids.size() / kIdSize;
  }
  if (trials != content["trials"].get<std::uint64_t>())
    return "found " + std::to_string(trials) + " trials; expected " + content["trials"].dump() + " by 'trials'";
  return "";
}

// Appends a message on every difference between the entries of two lists, matched by name.
void compare_lists(const char* key, const std::string& what, const Json& was, const Json& is,
                   std::vector<std::string>& changes) {
  std::map<std::string, const Json*> now;
  for (const Json& entry : is.at(key)) now[text_of(entry, "name") + "\n" + text_of(entry, "protocol")] = &entry;
  for (const Json& entry : was.at(key)) {
    const auto found = now.find(text_of(entry, "name") + "\n" + text_of(entry, "protocol"));
    if (found == now.end()) {
      changes.push_back(what + " '" + text_of(entry, "name") + "' was removed");
      continue;
    }
    for (const auto& [member, value] : entry.items())
      if (value != found->second->value(member, Json()))
        changes.push_back(what + " '" + text_of(entry, "name") + "', " + member + ": was " + value.dump() + ", is " +
                          found->second->value(member, Json()).dump());
    now.erase(found);
  }
  for (const auto& [name, entry] : now) changes.push_back(what + " '" + text_of(*entry, "name") + "' was added");
}

}  // namespace

Json freeze(const PreparedPlan& prepared, unsigned shards, const fs::path& folder, bool sandbox) {
  const suites::Suite& suite = prepared.plan.suite;
  const std::size_t instances = count_instances(prepared.plan);
  if (shards < 1 || shards > instances)
    throw Error(ErrorKind::bad_input, "--shards " + std::to_string(shards) + ": the suite can be split into 1 to " +
                                          std::to_string(instances) +
                                          " shards, one per instance of each scene and noise level");
  const LibraryHashes hashes = hash_libraries(suite);
  const auto common = [&hashes](const std::string& name, const plugin_host::Choice& choice) {
    return Json{{"name", name},
                {"plugin", choice.plugin->id},
                {"plugin_hash", hash_of(choice, hashes)},
                {"identity", parsed(choice.identity)}};
  };
  Json scenes = Json::array(), levels = Json::array(), algorithms = Json::array();
  for (std::size_t index = 0; index < suite.scenes.size(); ++index) {
    scenes.push_back(common(suite.scenes[index].name, suite.scenes[index].choice));
    scenes.back()["data"] = parsed(prepared.scene_identity[index]);
  }
  for (const suites::LevelEntry& entry : suite.levels) levels.push_back(common(entry.name, entry.choice));
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    algorithms.push_back(common(entry.name, entry.choice));
    algorithms.back()["protocol"] = entry.protocol;
  }
  const fs::path suite_folder = fs::absolute(fs::path(suite.file)).parent_path();
  Json content = {{"format", kPlanFormat},
                  {"name", suite.name},
                  {"suite", suite.text},
                  {"suite_file", suite.file},
                  {"suite_folder", fs::weakly_canonical(suite_folder)
                                       .lexically_proximate(fs::weakly_canonical(fs::absolute(folder)))
                                       .generic_string()},
                  {"shards", shards},
                  {"trials", prepared.plan.trials.size()},
                  {"instance_set", prepared.plan.instance_set},
                  {"program", json_of(this_program())},
                  {"scenes", std::move(scenes)},
                  {"noise_levels", std::move(levels)},
                  {"algorithms", std::move(algorithms)},
                  {"blocks", blocks_of(prepared)}};
  if (sandbox) content["sandbox"] = true;  // plans without one keep their hashes
  content["plan"] = hash_of_plan(content);
  return content;
}

FrozenPlan read_plan(const fs::path& file) {
  FrozenPlan plan;
  plan.file = file;
  plan.content = parsed_json(read_file(file));
  const Json& content = plan.content;
  const auto refuse = [&file](const std::string& why) {
    throw Error(ErrorKind::bad_input,
                file.string() + " " + why + "; make a plan with '" + own_command("plan SUITE -o FILE") + "'");
  };
  if (!content.is_object() || !content.contains("blocks") || !content.contains("format"))
    refuse("is not a plan (run a suite without --plan)");
  if (!content["format"].is_number_integer() || content["format"].get<std::int64_t>() < 1)
    refuse("has no valid 'format'");
  if (content["format"].get<std::int64_t>() > kPlanFormat)
    throw Error(ErrorKind::bad_input, file.string() + " has format " + content["format"].dump() +
                                          ", which is newer than this program's " + std::to_string(kPlanFormat) +
                                          "; use a newer relign-bench");
  for (const char* key : {"plan", "name", "suite", "suite_file", "suite_folder"})
    if (!content.contains(key) || !content[key].is_string())
      refuse(std::string("is damaged: missing key '") + key + "'");
  for (const char* key : {"shards", "trials"})
    if (!content.contains(key) || !content[key].is_number_unsigned())
      refuse(std::string("is damaged: missing key '") + key + "'");
  if (content.contains("sandbox") && !content["sandbox"].is_boolean())
    refuse("is damaged: 'sandbox' must be true or false");
  if (const std::string mistake = mistake_of_lists(content); !mistake.empty()) refuse("is damaged: " + mistake);
  plan.hash = hash_of_plan(content);
  if (plan.hash != content["plan"]) refuse("is damaged or was edited: its content does not match its hash");
  plan.name = content["name"].get<std::string>();
  plan.trials = content["trials"].get<std::size_t>();
  const auto shards = content["shards"].get<std::uint64_t>();
  if (shards < 1 || shards > std::max<std::size_t>(plan.trials, 1))
    refuse("is damaged: " + std::to_string(plan.trials) + " trials in " + std::to_string(shards) + " shards");
  plan.shards = static_cast<unsigned>(shards);
  plan.sandbox = flag_of(content, "sandbox");
  plan.suite_text = content["suite"].get<std::string>();
  plan.suite_file = content["suite_file"].get<std::string>();
  plan.suite_folder =
      (fs::absolute(file).parent_path() / content["suite_folder"].get<std::string>()).lexically_normal();
  return plan;
}

void check_unchanged(const FrozenPlan& frozen, const PreparedPlan& prepared) {
  const Json now = freeze(prepared, frozen.shards, fs::absolute(frozen.file).parent_path(), frozen.sandbox);
  if (now["plan"] == frozen.hash) return;
  std::vector<std::string> changes;
  compare_lists("scenes", "scene", frozen.content, now, changes);
  compare_lists("noise_levels", "noise level", frozen.content, now, changes);
  compare_lists("algorithms", "algorithm", frozen.content, now, changes);
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
  const auto place_of = [&plan](const char* list, const std::string& name) {
    const Json& entries = plan.content.at(list);
    std::size_t place = 0;
    while (place < entries.size() && text_of(entries[place], "name") != name) ++place;
    return place;
  };
  // The index of the first instance of each scene and noise level, in the order in which instances are dealt out.
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> first;
  std::vector<std::pair<std::pair<std::size_t, std::size_t>, std::string>> blocks;
  for (const Json& block : plan.content.at("blocks")) {
    const std::pair key(place_of("scenes", text_of(block, "scene")),
                        place_of("noise_levels", text_of(block, "noise_level")));
    blocks.emplace_back(key, text_of(block, "ids"));
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
