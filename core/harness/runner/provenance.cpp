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

}  // namespace

MachineTimeKeys keys_of(const trials::MachineTime& times) {
  return {times.speed_mm_per_s, times.speed_deg_per_s, times.settle_ms, times.exposure_ms, times.readout_ms};
}

records::SandboxLimits limits_of(const plugin_host::Sandbox& sandbox) {
  records::SandboxLimits limits{
      sandbox.memory_bytes, plugin_host::Sandbox::kProcesses, plugin_host::Sandbox::kDiskBytes, {}};
  for (const std::filesystem::path& path : sandbox.shown) limits.shown.push_back(path.string());
  return limits;
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

records::Program this_program() { return {RELIGN_VERSION, RELIGN_COMPILER, RELIGN_FLAGS, program_hash()}; }

std::string reproducible_of(const plugin_host::Choice& choice) {
  for (const auto& [parameter, inner] : choice.algorithms)
    if (reproducible_of(*inner) != "anywhere") return "this_cpu";
  if (text_of(plugin_host::side_file_of(choice), "reproducible") == "this_cpu") return "this_cpu";
  return choice.plugin->reproducible;
}

records::Machine this_machine() { return {cpu_name(), instruction_sets(), core_count(), system_name(), {}}; }

records::Manifest make_manifest(const PreparedPlan& prepared, const LibraryHashes& hashes, const std::string& command,
                                std::vector<records::Pretrained> learnt) {
  const suites::Suite& suite = prepared.plan.suite;
  const auto describe = [&hashes](records::PluginEntry& entry, const std::string& name,
                                  const plugin_host::Choice& choice) {
    entry.name = name;
    entry.id = choice.id;
    entry.plugin = choice.plugin->id;
    entry.kind = plugin_host::kind_name(choice.plugin->kind);
    entry.parameters = plugin_host::recorded_parameters(choice);
    entry.summary = choice.plugin->summary;
    entry.reproducible = reproducible_of(choice);
    entry.plugin_hash = hash_of(choice, hashes);
  };
  records::Manifest manifest;
  manifest.program = this_program();
  manifest.suite = suite.text;
  manifest.suite_file = suite.file;
  manifest.suite_name = suite.name;
  manifest.seed = suite.seed;
  manifest.commitment = suite.commitment;
  manifest.first_instance = suite.first_instance;
  manifest.instances = suite.instances;
  manifest.limits = suite.limits;
  manifest.instance_set = prepared.plan.instance_set;
  manifest.machine = this_machine();
  manifest.machine.scene_memory_bytes = prepared.scene_memory;
  for (std::size_t index = 0; index < suite.scenes.size(); ++index) {
    const trials::SceneFacts& facts = prepared.scenes[index];
    records::ManifestScene& scene = manifest.scenes.emplace_back();
    describe(scene, suite.scenes[index].name, suite.scenes[index].choice);
    scene.identity = suites::identity_json(suite.scenes[index].choice.identity);
    scene.data = suites::identity_json(prepared.scene_identity[index]);
    scene.folder = scene_folder(prepared, index);
    scene.machine_time = keys_of(facts.machine_time);
    scene.spec = facts.spec;
    scene.score = facts.score;
    scene.owns_stage = facts.owns_stage;
    scene.truth = facts.truth;
    scene.replayable = !facts.owns_stage;
  }
  for (const suites::LevelEntry& entry : suite.levels) {
    records::ManifestLevel& level = manifest.noise_levels.emplace_back();
    describe(level, entry.name, entry.choice);
    level.identity = suites::identity_json(entry.choice.identity);
  }
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    records::ManifestMethod& method = manifest.algorithms.emplace_back();
    describe(method, entry.name, entry.choice);
    method.observes = entry.choice.plugin->observes;
    method.oracle = suites::is_oracle(entry);
    method.protocol = entry.protocol;
    method.merit = suites::effective_merit(entry);
    method.steps = entry.steps;
    method.added = entry.added;
    if (const Json training = plugin_host::training_of(entry.choice); !training.is_null())
      method.training = read_described<records::ManifestMethod::Training>(training, entry.choice.id);
    if (!entry.training.empty()) method.of_list = {entry.method, entry.training};
  }
  manifest.prepared = std::move(learnt);
  manifest.trials = prepared.plan.trials.size();
  for (const suites::PlannedTrial& trial : prepared.plan.trials) manifest.order.push_back(trial.id);
  manifest.command = command;
  manifest.spec = suite.spec;
  manifest.targets = suite.targets;
  manifest.machine_time = suite.machine_time;
  manifest.cycle = suite.cycle;
  manifest.cost = suite.cost;
  manifest.analysis = suite.analysis;
  if (suite.analysis) manifest.analysis_hash = sha256_hex(canonical_json(json_of(*suite.analysis)));
  manifest.shard = prepared.shard;
  return manifest;
}

}  // namespace relign::runner
