#include "runner/provenance.h"

#include <sys/utsname.h>

#include <fstream>
#include <functional>

#include "base/hash.h"
#include "base/json_members.h"
#include "base/machine.h"
#include "plugin_host/catalog.h"
#include "plugin_host/confinement.h"
#include "plugin_host/objects.h"
#include "plugin_host/training.h"
#include "records/record.h"

namespace relign::runner {
namespace {

// The text after the separator in the first line that starts with `key`; empty if there is none.
std::string value_in_file(const char* file, const std::string& key, char separator) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t at = line.find(separator);
    if (at == std::string::npos) continue;
    std::string value = line.substr(at + 1);
    value.erase(0, value.find_first_not_of(" \t\""));
    value.erase(value.find_last_not_of(" \t\"") + 1);
    return value;
  }
  return "";
}

std::string cpu_name() {
  const std::string model = value_in_file("/proc/cpuinfo", "model name", ':');
  if (!model.empty()) return model;
  utsname system{};
  return ::uname(&system) == 0 ? system.machine : "unknown";
}

std::string system_name() {
  utsname system{};
  const std::string kernel = ::uname(&system) == 0 ? std::string(system.sysname) + " " + system.release : "unknown";
  const std::string distribution = value_in_file("/etc/os-release", "PRETTY_NAME", '=');
  return distribution.empty() ? kernel : distribution + ", " + kernel;
}

// Hash of the running program; empty where it cannot be read.
std::string program_hash() {
  try {
    return sha256_file("/proc/self/exe");
  } catch (const Error&) {
    return "";
  }
}

Json parsed(const std::string& json) {
  Json value = parsed_json(json);
  return value.is_discarded() ? Json(json) : value;
}

}  // namespace

Json machine_time_json(const trials::MachineTime& times) {
  return {{"speed_mm_per_s", times.speed_mm_per_s},
          {"speed_deg_per_s", times.speed_deg_per_s},
          {"settle_ms", times.settle_ms},
          {"exposure_ms", times.exposure_ms},
          {"readout_ms", times.readout_ms}};
}

Json sandbox_json(const plugin_host::Sandbox& sandbox) {
  Json shown = Json::array();
  for (const std::filesystem::path& path : sandbox.shown) shown.push_back(path.string());
  return {{"memory_bytes", sandbox.memory_bytes},
          {"processes", plugin_host::Sandbox::kProcesses},
          {"disk_bytes", plugin_host::Sandbox::kDiskBytes},
          {"shown", std::move(shown)}};
}

LibraryHashes hash_libraries(const suites::Suite& suite) {
  LibraryHashes hashes;
  const std::function<void(const plugin_host::Choice&)> add = [&](const plugin_host::Choice& choice) {
    std::string& hash = hashes[choice.plugin->library.string()];
    if (hash.empty()) hash = plugin_host::plugin_hash(*choice.plugin);
    for (const auto& [parameter, inner] : choice.algorithms) add(*inner);
  };
  for (const suites::SceneEntry& entry : suite.scenes) add(entry.choice);
  for (const suites::LevelEntry& entry : suite.levels) add(entry.choice);
  for (const suites::AlgorithmEntry& entry : suite.algorithms) add(entry.choice);
  return hashes;
}

std::string hash_of(const plugin_host::Choice& choice, const LibraryHashes& hashes) {
  std::string hash = hashes.at(choice.plugin->library.string());
  for (const auto& [parameter, inner] : choice.algorithms) hash = sha256_hex(hash + hash_of(*inner, hashes));
  return hash;
}

Json program_json() {
  return {
      {"version", RELIGN_VERSION}, {"compiler", RELIGN_COMPILER}, {"flags", RELIGN_FLAGS}, {"hash", program_hash()}};
}

std::string reproducible_of(const plugin_host::Choice& choice) {
  for (const auto& [parameter, inner] : choice.algorithms)
    if (reproducible_of(*inner) != "anywhere") return "this_cpu";
  if (text_of(plugin_host::side_file_of(choice), "reproducible") == "this_cpu") return "this_cpu";
  return choice.plugin->reproducible;
}

Json machine_json() {
  return {{"cpu", cpu_name()},
          {"instruction_sets", instruction_sets()},
          {"cores", core_count()},
          {"system", system_name()}};
}

Json make_manifest(const PreparedPlan& prepared, const LibraryHashes& hashes, const std::string& command,
                   const Json& learnt) {
  const suites::Suite& suite = prepared.plan.suite;
  const auto common = [&hashes](const std::string& name, const plugin_host::Choice& choice) {
    return Json{{"name", name},
                {"id", choice.id},
                {"plugin", choice.plugin->id},
                {"kind", plugin_host::kind_name(choice.plugin->kind)},
                {"parameters", plugin_host::recorded_parameters(choice)},
                {"summary", choice.plugin->summary},
                {"reproducible", reproducible_of(choice)},
                {"plugin_hash", hash_of(choice, hashes)}};
  };
  Json scenes = Json::array();
  for (std::size_t index = 0; index < suite.scenes.size(); ++index) {
    Json scene = common(suite.scenes[index].name, suite.scenes[index].choice);
    scene["identity"] = parsed(suite.scenes[index].choice.identity);
    scene["data"] = parsed(prepared.scene_identity[index]);
    scene["folder"] = scene_folder(prepared, index);
    scene["machine_time"] = machine_time_json(prepared.scenes[index].machine_time);
    scene["spec"] = prepared.scenes[index].spec;
    if (!prepared.scenes[index].score.squared) scene["score"] = scene_score_json(prepared.scenes[index].score);
    scene["owns_stage"] = prepared.scenes[index].owns_stage;
    scene["truth"] = prepared.scenes[index].truth;
    scene["replayable"] = !prepared.scenes[index].owns_stage;
    scenes.push_back(std::move(scene));
  }
  Json levels = Json::array();
  for (const suites::LevelEntry& entry : suite.levels) {
    Json level = common(entry.name, entry.choice);
    level["identity"] = parsed(entry.choice.identity);
    levels.push_back(std::move(level));
  }
  Json algorithms = Json::array();
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    Json algorithm = common(entry.name, entry.choice);
    algorithm["observes"] = entry.choice.plugin->observes;
    algorithm["oracle"] = suites::is_oracle(entry);
    algorithm["protocol"] = entry.protocol;
    algorithm["merit"] = suites::effective_merit(entry);
    algorithm["steps"] = entry.steps;
    algorithm["added"] = entry.added;
    if (Json training = plugin_host::training_of(entry.choice); !training.is_null())
      algorithm["training"] = std::move(training);
    if (!entry.training.empty()) algorithm["of_list"] = {{"method", entry.method}, {"training", entry.training}};
    algorithms.push_back(std::move(algorithm));
  }
  Json order = Json::array();
  for (const suites::PlannedTrial& trial : prepared.plan.trials) order.push_back(trial.id);
  Json manifest = {{"format", records::kFormat},
                   {"program", program_json()},
                   {"suite", suite.text},
                   {"suite_file", suite.file},
                   {"suite_name", suite.name},
                   {"seed", suite.seed},
                   {"first_instance", suite.first_instance},
                   {"instances", suite.instances},
                   {"limits", suite.limits},
                   {"instance_set", prepared.plan.instance_set},
                   {"machine", machine_json()},
                   {"scenes", std::move(scenes)},
                   {"noise_levels", std::move(levels)},
                   {"algorithms", std::move(algorithms)},
                   {"prepared", learnt},
                   {"trials", prepared.plan.trials.size()},
                   {"order", std::move(order)},
                   {"command", command},
                   {"spec", suite.spec},
                   {"targets", suite.targets},
                   {"machine_time", suites::machine_time_json(suite.machine_time)}};
  if (!prepared.scene_memory.empty()) manifest["machine"]["scene_memory_bytes"] = prepared.scene_memory;
  if (!suite.cycle.is_null()) manifest["cycle"] = suite.cycle;
  if (!suite.cost.is_null()) manifest["cost"] = suite.cost;
  if (!suite.analysis.is_null()) {
    manifest["analysis"] = suite.analysis;
    manifest["analysis_hash"] = sha256_hex(canonical_json(suite.analysis));
  }
  if (!suite.commitment.empty()) manifest["commitment"] = suite.commitment;
  if (!prepared.shard.is_null()) manifest["shard"] = prepared.shard;
  return manifest;
}

}  // namespace relign::runner
