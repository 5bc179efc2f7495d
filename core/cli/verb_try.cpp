// relign-bench try: runs one trial in this process, so that prints and debuggers work, and prints every step.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "base/json_source.h"
#include "base/limits.h"
#include "base/scene_score.h"
#include "base/seeds.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/frames.h"
#include "cli/guarded_trial.h"
#include "cli/interrupt.h"
#include "cli/pretraining_job.h"
#include "cli/workbench.h"
#include "plugin_host/training.h"
#include "records/record.h"
#include "runner/merits.h"
#include "trials/trial.h"

namespace relign::cli {
namespace {

struct TryArguments {
  std::string algorithm;
  std::string parameters;  // JSON; empty: none
  std::string scene = "relign_od";
  std::string level;  // empty: the scene's default
  std::uint64_t instance = 0;
  std::uint64_t suite_seed = 1;
  std::string protocol = "paper";
  std::string merit;  // empty: the protocol's
  unsigned steps = 50;
  std::string frames;
};

constexpr int kDecimals = 5;  // of a score

// Noise-free errors are accurate to the score's resolution. A score clearly below 0 is a fault of its scene.
std::string noise_free_text(double recorded, const SceneScore& score) {
  if (std::isnan(recorded)) return "unknown";
  if (!score.squared && recorded <= -score.resolution) return fixed(recorded, kDecimals);
  const double value = score.shown(recorded);
  return value < score.resolution ? "<" + shortest(score.resolution) : fixed(value, kDecimals);
}

std::string header(std::size_t axes) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, "step  %-*s  %8s  %8s  %9s  %11s\n", static_cast<int>(axes * 7),
                "commanded pose", "merit", "measured", "commanded", "recommended");
  return buffer;
}

std::string row(const trials::Step& step, const SceneScore& score) {
  std::string pose;
  for (const double coordinate : step.commanded_pose) {
    char buffer[16];
    std::snprintf(buffer, sizeof buffer, "%6.3f ", coordinate);
    pose += buffer;
  }
  char buffer[64 + 64 * 16];
  std::snprintf(buffer, sizeof buffer, "%4u  %s  %8s  %8s  %9s  %11s\n", step.step, pose.c_str(),
                fixed(step.merit, kDecimals).c_str(),
                (step.regions.empty() ? fixed(step.measured, kDecimals) : "regions").c_str(),
                noise_free_text(step.commanded_mse, score).c_str(),
                noise_free_text(step.recommended_mse, score).c_str());
  return buffer;
}

Json to_json(const trials::Step& step) {
  Json json = valid_json(records::step_line("", step));
  json.erase("trial");
  return json;
}

Json to_json(const TryArguments& arguments, const trials::TrialResult& result) {
  Json steps = Json::array();
  for (const trials::Step& step : result.steps) steps.push_back(to_json(step));
  return {{"algorithm", arguments.algorithm},
          {"scene", arguments.scene},
          {"noise_level", arguments.level},
          {"instance", arguments.instance},
          {"protocol", arguments.protocol},
          {"end", result.outcome.empty() ? trials::end_name(result.end) : result.outcome},
          {"message", result.message},
          {"warnings", result.environment_changes},
          {"steps", steps}};
}

int end_of_trial(Context& context, const TryArguments& arguments, const trials::TrialResult& result,
                 const trials::SceneFacts& facts) {
  for (const std::string& change : result.environment_changes) print_warning(change);
  if (context.json) print_result(to_json(arguments, result).dump(2) + "\n");
  switch (result.end) {
    case trials::End::failed:
    case trials::End::overspent:
      print_warning(arguments.algorithm + " failed: " + result.message);
      return kTrialsFailed;
    case trials::End::stopped:
      std::fprintf(stderr, "Stopped. To run the trial again from step 0:\n  %s\n", context.typed_command().c_str());
      return stop_exit_code();
    case trials::End::finished:
      std::fprintf(stderr, "%s ended the trial after step %zu.\n", arguments.algorithm.c_str(),
                   result.steps.size() - 1);
      break;
    case trials::End::budget_spent:
      break;
  }
  if (!context.json)
    std::fprintf(stderr, "%s%s%s\n", facts.score.label().c_str(),
                 facts.score.squared ? " against the reference image" : "",
                 facts.truth ? "; commanded and recommended are noise-free and never shown to the algorithm."
                             : ", measured only: this scene has no ground truth.");
  return kDone;
}

// The algorithm's pretraining, from the cache or made now; null if it has none.
std::shared_ptr<const trials::PreparedByIdentity> pretraining_of(
    const LoadedScene& scene, const plugin_host::Choice& level, const plugin_host::Choice& algorithm,
    trials::Protocol protocol, std::optional<trials::Merit> merit, const plugin_host::HostServices& services) {
  if (!plugin_host::is_prepared(algorithm)) return nullptr;
  runner::Pretrainer pretrainer(pretrainer_options(services));
  runner::TrialJob job = job_for(scene, level, algorithm, protocol);
  if (merit) job.merit = *merit;
  return runner::data_of(pretrainer.prepare(job, runner::data_identity(scene.facts)));
}

int run_try(Context& context, const TryArguments& given) {
  TryArguments arguments = given;
  context.start_sandbox("");
  plugin_host::adopt_orphans();
  plugin_host::Catalog& catalog = context.catalog();
  const plugin_host::Choice algorithm = named_choice(catalog, plugin_host::Kind::optimizer, arguments.algorithm,
                                                     "ALGORITHM", read_parameters(arguments.parameters));
  plugin_host::HostServices services = context.services(core_count());
  services.stop = &watch_for_stop();
  services.log = [warn = services.log](int level, const std::string& message) {
    if (level >= RELIGN_LOG_WARNING)
      warn(level, message);
    else
      std::fprintf(stderr, "%s\n", printable(message).c_str());  // output of scenes that are processes
  };
  const LoadedScene scene =
      load_scene(named_choice(catalog, plugin_host::Kind::scene, arguments.scene, "--scene"), services);
  if (arguments.level.empty()) arguments.level = default_level(scene.facts);
  const plugin_host::Choice level =
      named_choice(catalog, plugin_host::Kind::noise_level, arguments.level, "--noise-level");
  if (scene.facts.owns_stage && level.plugin->id != "none")
    throw Error(ErrorKind::bad_input, "noise level '" + arguments.level +
                                          "' cannot be used with the hardware station '" + arguments.scene +
                                          "', which has its own lenses, start pose and stage; use none");
  const trials::Instance instance = draw_instance(level, scene, services, arguments.suite_seed, arguments.instance);
  std::optional<plugin_host::MountedAssembly> assembly;
  if (!scene.facts.owns_stage) assembly.emplace(scene.scene->mount(instance.perturbations.elements_json));

  plugin_host::NoiseLevel prior(level, services);
  trials::ModelScene model(*scene.scene, scene.choice, services);
  trials::TrialSetup setup{
      .stage =
          assembly ? trials::StageSetup(trials::SimulatedLens{*assembly, model, prior}) : trials::Station{*scene.scene},
      .reference = scene.scene->reference(),
      .scene = scene.facts,
      .instance = instance,
      .algorithm = algorithm,
      .terms = {.protocol = *trials::protocol_from_name(arguments.protocol),
                .merit = trials::merit_from_name(arguments.merit),
                .mtf_limits = runner::limits_of(records::specification_of(Json(), scene.facts.spec, scene.facts.score)),
                .budget = arguments.steps,
                .algorithm_seed = algorithm_seed(arguments.suite_seed, algorithm.id, arguments.instance),
                .machine_time = scene.facts.machine_time},
      .services = services};
  setup.services.log = [](int, const std::string& message) {
    std::fprintf(stderr, "%s\n", printable(message).c_str());
  };
  if (const auto prepared = pretraining_of(scene, level, algorithm, setup.terms.protocol, setup.terms.merit, services))
    setup.prepared = *prepared;
  setup.callbacks.on_step = [&](const trials::Step& step, const float* pixels) {
    if (!context.json)
      print_result((step.step == 0 ? header(scene.facts.axes.size()) : "") + row(step, scene.facts.score));
    if (!arguments.frames.empty()) save_frame(arguments.frames, step.step, scene.facts, pixels);
  };
  trials::TrialResult result;
  try {
    result = run_guarded(setup, context.json);
  } catch (const Error& error) {
    if (!services.stop->load()) throw;
    print_warning(error.what());  // of a process that the host no longer waits for
    result.end = trials::End::stopped;
  }
  return end_of_trial(context, arguments, result, scene.facts);
}

}  // namespace

void add_try(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(
      app, {"try", "Run one trial in this process and print every step.",
            "relign-bench try nlopt-sbplx --noise-level rho0.5 --instance 3 --frames frames\n"
            "relign-bench try nlopt-sbplx --parameters '{\"first_stride\": 0.1}'\n"
            "relign-bench try imitation-ppo --noise-level '{\"use\": \"rho\", \"parameters\": {\"level\": 0.75}}'",
            "list, describe, run"});
  TryArguments& arguments =
      add_action(verb, context, run_try, "Stopped before the trial. To start again, run the same command:");
  verb.add_option("ALGORITHM", arguments.algorithm,
                  "algorithm: id, preset, path, or an object with \"use\" and \"parameters\" as in a suite")
      ->required();
  verb.add_option("--parameters", arguments.parameters,
                  "algorithm parameters as a JSON object; listed by describe [default: the plugin's]")
      ->type_name("JSON");
  verb.add_option("--scene", arguments.scene, "scene: id, preset, path, or an object as in a suite")
      ->type_name("SCENE")
      ->capture_default_str();
  verb.add_option("--noise-level", arguments.level,
                  "noise level: id, preset, path, or an object as in a suite; a hardware station requires 'none'")
      ->default_str("rho0.25; rho0 for a scene with fewer than two elements")
      ->type_name("LEVEL");
  verb.add_option("--instance", arguments.instance, "instance number, from 0")
      ->type_name("NUMBER")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_option("--suite-seed", arguments.suite_seed, "suite seed from which the instance is drawn")
      ->type_name("SEED")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_option("--protocol", arguments.protocol, "protocol (what the algorithm observes): paper or blind")
      ->type_name("NAME")
      ->check(CLI::IsMember({"paper", "blind"}))
      ->capture_default_str();
  verb.add_option("--merit", arguments.merit,
                  "merit: combined, rmse, or by field mtf or edge_energy [default: the protocol's]")
      ->type_name("NAME")
      ->check(CLI::IsMember(trials::merit_names()));
  verb.add_option("--steps", arguments.steps, "budget: number of steps (a move and a capture each) after step 0")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, kMaxSteps))
      ->capture_default_str();
  add_sandbox_options(verb, context);
  verb.add_option("--frames", arguments.frames, "write every capture to DIR/step-NNN.png [default: none]")
      ->type_name("DIR");
}

}  // namespace relign::cli
