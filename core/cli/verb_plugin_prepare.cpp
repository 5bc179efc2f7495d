// relign-bench plugin prepare: pretrains an algorithm on source instances, which are never benchmark instances.
#include <cstdio>
#include <memory>

#include "base/error.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/interrupt.h"
#include "cli/pretraining_job.h"
#include "plugin_host/training.h"

namespace relign::cli {
namespace {

struct PrepareArguments {
  std::string algorithm;
  std::string parameters;  // JSON; empty: none
  std::string scene = "relign_od";
  std::string level;  // empty: the scene's default
  std::string protocol = "paper";
  bool again = false;
};

Json to_json(const runner::PretrainingEntry& entry) {
  return {{"plugin", entry.algorithm},   {"sources", entry.sources},     {"steps", entry.steps},
          {"made_now", entry.made_now},  {"seconds", entry.seconds},     {"sha256", entry.data.hash},
          {"file", entry.file.string()}, {"failure", entry.data.failure}};
}

std::string line_of(const runner::PretrainingEntry& entry) {
  char made[64] = "already in the cache";
  if (entry.made_now) std::snprintf(made, sizeof made, "pretrained in %.1f s", entry.seconds);
  return entry.algorithm + ": " + counted(entry.sources, "source instance") + " of " + counted(entry.steps, "step") +
         ", " + made + "\n" + (entry.file.empty() ? "not kept: no cache folder" : entry.file.string()) + "\n";
}

int prepare_plugin(Context& context, const PrepareArguments& arguments) {
  plugin_host::Catalog& catalog = context.catalog();
  const plugin_host::Choice algorithm = named_choice(catalog, plugin_host::Kind::optimizer, arguments.algorithm,
                                                     "ALGORITHM", read_parameters(arguments.parameters));
  if (!plugin_host::is_prepared(algorithm))
    throw Error(ErrorKind::bad_input, "'" + algorithm.id + "' has no pretraining: its manifest has no \"prepare\"");
  plugin_host::HostServices services = context.services(core_count());
  services.stop = &watch_for_stop();
  const LoadedScene scene =
      load_scene(named_choice(catalog, plugin_host::Kind::scene, arguments.scene, "--scene"), services);
  if (scene.facts.owns_stage)
    throw Error(
        ErrorKind::bad_input,
        "'" + arguments.scene + "' is a hardware station with its own lenses; source instances cannot be drawn");
  const std::string level_name = arguments.level.empty() ? default_level(scene.facts) : arguments.level;
  const plugin_host::Choice level = named_choice(catalog, plugin_host::Kind::noise_level, level_name, "--noise-level");
  const runner::TrialJob job = job_for(scene, level, algorithm, *trials::protocol_from_name(arguments.protocol));

  runner::Pretrainer pretrainer(pretrainer_options(services, arguments.again));
  Json all = Json::array();
  std::string failure;
  for (const auto& [identity, entry] : pretrainer.prepare(job, runner::data_identity(scene.facts))) {
    all.push_back(to_json(entry));
    if (failure.empty()) failure = entry.data.failure;
    if (!context.json && entry.data.failure.empty()) print_result(line_of(entry));
  }
  if (context.json) print_result(all.dump(2) + "\n");
  if (failure.empty()) return kDone;
  print_warning(failure);
  return kTrialsFailed;
}

}  // namespace

void add_plugin_prepare(CLI::App& plugin, Context& context) {
  CLI::App& verb =
      add_verb(plugin, {"prepare",
                        "Pretrain an algorithm on source instances, which are never benchmark instances, and keep the "
                        "result in the user's cache. run and try do so automatically.",
                        "relign-bench plugin prepare transfer-gp --noise-level rho0.5", "run, try, describe"});
  PrepareArguments& arguments =
      add_action(verb, context, prepare_plugin, "Stopped; nothing was kept. To start again, run the same command:");
  verb.add_option("ALGORITHM", arguments.algorithm, "algorithm: id, preset or path")->required();
  verb.add_option("--parameters", arguments.parameters,
                  "algorithm parameters as a JSON object, the same as in its trials; listed by describe [default: the "
                  "plugin's]")
      ->type_name("JSON");
  verb.add_option("--scene", arguments.scene, "scene: id, preset, path, or an object as in a suite")
      ->type_name("SCENE")
      ->capture_default_str();
  verb.add_option("--noise-level", arguments.level, "noise level: id, preset, path, or an object as in a suite")
      ->default_str("rho0.25; rho0 for a scene with fewer than two elements")
      ->type_name("LEVEL");
  verb.add_option("--protocol", arguments.protocol, "protocol (what the algorithm observes): paper or blind")
      ->type_name("NAME")
      ->check(CLI::IsMember({"paper", "blind"}))
      ->capture_default_str();
  verb.add_flag("--again", arguments.again, "pretrain again, replacing a cached result");
}

}  // namespace relign::cli
