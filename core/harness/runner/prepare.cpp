#include <algorithm>
#include <exception>
#include <set>
#include <utility>

#include "base/hash.h"
#include "base/machine.h"
#include "plugin_host/objects.h"
#include "runner/levels.h"
#include "runner/merits.h"
#include "runner/run.h"
#include "runner/spec_check.h"
#include "runner/stations.h"
#include "trials/stage.h"

namespace relign::runner {
namespace {

void check_stop(const std::atomic<bool>* stop) {
  if (stop && stop->load()) throw Error(ErrorKind::stopped, "stopped before the first trial");
}

PreparedPlan prepare_all(suites::Suite suite, const std::filesystem::path& cache_folder,
                         const std::function<void(const std::string&)>& on_message, const std::atomic<bool>* stop,
                         std::shared_ptr<const plugin_host::Sandbox> sandbox) {
  PreparedPlan prepared;
  plugin_host::HostServices services;
  services.stop = stop;
  services.sandbox = std::move(sandbox);
  services.threads = core_count();
  services.cache_folder = cache_folder;
  const auto as = [&services, &on_message](const std::string& name) {
    plugin_host::HostServices own = services;
    if (on_message)
      own.log = [&on_message, name](int level, const std::string& message) {
        if (level >= RELIGN_LOG_WARNING) on_message(name + ": " + message);
      };
    return own;
  };

  std::string mistakes;
  for (const suites::SceneEntry& entry : suite.scenes) {
    check_stop(stop);
    forget_peak_memory();
    plugin_host::Scene scene(entry.choice, as(entry.name));
    prepared.scenes.push_back(trials::facts_of(scene, entry.choice.id));
    prepared.scene_identity.push_back(data_identity(prepared.scenes.back()));
    scene.reference();
    prepared.scene_memory[entry.name] = peak_memory_bytes();
    const records::Specification spec =
        records::specification_of(suite.spec, prepared.scenes.back().spec, prepared.scenes.back().score);
    for (const std::string& warning : mtf_warnings(spec, prepared.scenes.back()))
      if (on_message) on_message(entry.name + ": " + warning);
    try {
      check_mtf(suite, entry.name, scene, prepared.scenes.back());
      check_criteria(suite, entry.name, scene, prepared.scenes.back());
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input) throw;
      mistakes += (mistakes.empty() ? "" : "\n") + std::string(error.what());
    }
  }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
  check_units(suite, prepared.scenes);
  check_stations(suite, prepared.scenes);
  check_merits(suite, prepared.scenes);
  for (const std::string& note : leave_out_told_methods(suite, prepared.scenes))
    if (on_message) on_message(note);
  const auto level_services = [&](const std::string& name) {
    check_stop(stop);
    return as(name);
  };
  for (const std::string& note : check_levels(suite, prepared.scenes, level_services))
    if (on_message) on_message(note);
  std::set<std::filesystem::path> loaded;
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    if (!loaded.insert(entry.choice.plugin->library).second) continue;
    check_stop(stop);
    try {
      plugin_host::Algorithm(entry.choice, as(entry.name));
    } catch (const Error& error) {
      // A library that cannot be loaded ends the run. One that cannot create its object fails in its own trials, and
      // the others run.
      if (error.kind() != ErrorKind::plugin_failed) throw;
    }
  }
  check_stop(stop);
  prepared.plan = suites::make_plan(std::move(suite), prepared.scene_identity, stop);
  leave_out_told_trials(prepared.plan, prepared.scenes);
  return prepared;
}

}  // namespace

// Without paths, which differ between machines.
std::string data_identity(const trials::SceneFacts& facts) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const std::string& file : facts.files)
    files.emplace_back(std::filesystem::path(file).filename().string(), sha256_file(file));
  std::sort(files.begin(), files.end());
  Json list = Json::array();
  for (const auto& [name, hash] : files) list.push_back({{"name", name}, {"sha256", hash}});
  return canonical_json({{"files", std::move(list)}});
}

PreparedPlan prepare(suites::Suite suite, const std::filesystem::path& cache_folder,
                     const std::function<void(const std::string&)>& on_message, const std::atomic<bool>* stop,
                     std::shared_ptr<const plugin_host::Sandbox> sandbox) {
  try {
    return prepare_all(std::move(suite), cache_folder, on_message, stop, std::move(sandbox));
  } catch (const Error&) {
    check_stop(stop);  // after a stop, an error may come from a process that we no longer wait for
    throw;
  }
}

std::string scene_folder(const PreparedPlan& prepared, std::size_t scene) {
  return "scenes/" +
         short_hash(prepared.plan.suite.scenes.at(scene).choice.identity + "\n" + prepared.scene_identity.at(scene));
}

}  // namespace relign::runner
