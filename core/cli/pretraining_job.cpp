#include "cli/pretraining_job.h"

#include <cstdio>

#include "base/error.h"
#include "base/json_source.h"
#include "base/text.h"
#include "runner/merits.h"

namespace relign::cli {

runner::TrialJob job_for(const LoadedScene& scene, const plugin_host::Choice& level,
                         const plugin_host::Choice& algorithm, trials::Protocol protocol) {
  runner::TrialJob job;
  job.scene_name = scene.choice.id;
  job.level_name = level.id;
  job.algorithm_name = algorithm.id;
  job.scene = scene.choice;
  job.level = level;
  job.algorithm = algorithm;
  job.facts = scene.facts;
  job.protocol = protocol;
  const bool rmse = protocol == trials::Protocol::blind || scene.facts.owns_stage;
  job.merit = rmse ? trials::Merit::rmse : trials::Merit::combined;
  job.mtf_limits = runner::limits_of(records::specification_of(Json(), scene.facts.spec, scene.facts.score));
  job.machine_time = scene.facts.machine_time;
  return job;
}

runner::Pretrainer::Options pretrainer_options(const plugin_host::HostServices& services, bool again) {
  runner::Pretrainer::Options options;
  options.threads = services.threads;
  options.cache_folder = services.cache_folder;
  options.on_message = [](const std::string& message) { std::fprintf(stderr, "%s\n", printable(message).c_str()); };
  options.stop = services.stop;
  options.sandbox = services.sandbox;
  options.again = again;
  return options;
}

Json read_parameters(const std::string& text) {
  if (text.empty()) return {};
  Json given = JsonSource::from_text(text, "--parameters").root();
  if (!given.is_object())
    throw Error(ErrorKind::bad_input,
                "--parameters: expected a JSON object such as '{\"first_stride\": 0.1}', found '" + text + "'");
  return given;
}

std::string default_level(const trials::SceneFacts& scene) {
  if (scene.owns_stage) return "none";
  return scene.elements.size() < 2 ? "rho0" : "rho0.25";
}

}  // namespace relign::cli
