// relign-bench-near: trials that start near the best pose of their instance, where an agent or a global search would
// have arrived, to measure how close local methods get. Suites cannot do this: they draw starts from the noise level.
//
//   relign-bench-near ceres-image nlopt-bobyqa '{"use": "ceres", "parameters": {"difference": 0.03}}'
//
// Instances are those of a suite with the same seed, except for the start: own optimum + uniform +- radius on every
// axis.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <relign/random.hpp>

#include "base/displayed_rmse.h"
#include "base/error.h"
#include "base/json_source.h"
#include "base/seeds.h"
#include "trials/stage.h"
#include "trials/trial.h"

namespace relign {
namespace {

using plugin_host::Choice;
using plugin_host::Kind;

struct Arguments {
  std::vector<std::string> algorithms;
  std::string scene = "relign_od", level = "rho0.25", protocol = "paper";
  std::uint64_t instances = 50, seed = 1;
  unsigned steps = 40;
  double radius = 0.1, within = 0.003;
  bool every = false;
};

struct Lens {
  trials::Instance instance;
  plugin_host::MountedAssembly assembly;
  double optimum_rmse;
};

Choice choose(plugin_host::Catalog& catalog, const std::string& text) {
  if (text.empty() || text[0] != '{') return catalog.resolve_or_throw(Kind::optimizer, text);
  const Json entry = JsonSource::from_text(text, "algorithm").root();
  return catalog.resolve_or_throw(Kind::optimizer, entry.at("use").get<std::string>(),
                                  entry.value("parameters", Json{}));
}

Lens draw_near(plugin_host::Scene& scene, const trials::SceneFacts& facts, plugin_host::NoiseLevel& level,
               const Arguments& given, std::uint64_t number) {
  trials::Instance instance = trials::draw_instance(level, facts, given.seed, SeedDomain::benchmark, number);
  plugin_host::MountedAssembly assembly = scene.mount(instance.perturbations.elements_json);
  const auto optimum = assembly.own_optimum(frame_seed(instance.seed, 0, FrameStream::own_optimum));
  if (!optimum)
    throw Error(ErrorKind::bad_input,
                "the scene does not provide the best pose of its assemblies; choose another --scene");
  Random random(instance.seed, 0x6e656172);  // a separate stream
  for (std::size_t axis = 0; axis < facts.axes.size(); ++axis)
    instance.perturbations.start[axis] =
        std::clamp(optimum->true_pose[axis] + given.radius * random.uniform(-1, 1), 0.0, 1.0);
  return {std::move(instance), std::move(assembly), displayed_rmse(optimum->mse)};
}

// Excess RMSE of the recommended pose over the instance's best pose after each step; the last value is carried forward
// after an early end.
std::vector<double> excess(Lens& lens, plugin_host::Scene& scene, trials::ModelScene& model,
                           plugin_host::NoiseLevel& level, const trials::SceneFacts& facts, const Choice& algorithm,
                           const Arguments& given) {
  trials::TrialSetup setup{.stage = trials::SimulatedLens{lens.assembly, model, level},
                           .reference = scene.reference(),
                           .scene = facts,
                           .instance = lens.instance,
                           .algorithm = algorithm,
                           .terms = {.protocol = *trials::protocol_from_name(given.protocol),
                                     .budget = given.steps,
                                     .algorithm_seed = algorithm_seed(given.seed, algorithm.id, lens.instance.number),
                                     .machine_time = facts.machine_time}};
  setup.services.log = [](int, const std::string& message) { std::fprintf(stderr, "%s\n", message.c_str()); };
  const trials::TrialResult result = trials::run_trial(setup);
  if (result.end == trials::End::failed) throw Error(ErrorKind::plugin_failed, algorithm.id + ": " + result.message);
  std::vector<double> worse;
  for (const trials::Step& step : result.steps)
    worse.push_back(displayed_rmse(step.recommended_mse) - lens.optimum_rmse);
  worse.resize(given.steps + 1, worse.back());
  return worse;
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * double(values.size())))];
}

void print_table(const std::string& name, const std::vector<std::vector<double>>& trials, const Arguments& given) {
  std::printf("%s\n  step  within %.4g  median    90 %%\n", name.c_str(), given.within);
  for (unsigned step = 0; step <= given.steps; step += 5) {
    std::vector<double> at;
    for (const auto& trial : trials) at.push_back(trial[step]);
    const auto reached = std::count_if(at.begin(), at.end(), [&](double value) { return value <= given.within; });
    std::printf("  %4u  %8.0f %%    %.5f  %.5f\n", step, 100.0 * double(reached) / double(at.size()), quantile(at, 0.5),
                quantile(at, 0.9));
  }
}

void run(const Arguments& given) {
  plugin_host::Catalog catalog;
  catalog.scan(RELIGN_PLUGIN_DIR);
  std::vector<Choice> algorithms;
  for (const std::string& text : given.algorithms) algorithms.push_back(choose(catalog, text));
  const Choice choice = catalog.resolve_or_throw(Kind::scene, given.scene);
  plugin_host::Scene scene(choice, {});
  trials::ModelScene model(scene, choice, {});
  const trials::SceneFacts facts = trials::facts_of(scene, given.scene);
  plugin_host::NoiseLevel level(catalog.resolve_or_throw(Kind::noise_level, given.level), {});

  std::vector<std::vector<std::vector<double>>> trials(algorithms.size());
  for (std::uint64_t number = 0; number < given.instances; ++number) {
    Lens lens = draw_near(scene, facts, level, given, number);
    for (std::size_t i = 0; i < algorithms.size(); ++i) {
      trials[i].push_back(excess(lens, scene, model, level, facts, algorithms[i], given));
      if (given.every)
        std::printf("%s %llu: own optimum %.5f, start +%.5f, end +%.5f\n", algorithms[i].id.c_str(),
                    static_cast<unsigned long long>(number), lens.optimum_rmse, trials[i].back().front(),
                    trials[i].back().back());
    }
  }
  for (std::size_t i = 0; i < algorithms.size(); ++i) print_table(given.algorithms[i], trials[i], given);
}

}  // namespace
}  // namespace relign

int main(int count, char** words) {
  relign::Arguments given;
  CLI::App app{
      "Run trials that start near the best pose of their instance and print the excess noise-free RMSE over it."};
  app.add_option("ALGORITHM", given.algorithms, "id, preset, or JSON with use and parameters")->required();
  app.add_option("--scene", given.scene)->capture_default_str();
  app.add_option("--noise-level", given.level)->capture_default_str();
  app.add_option("--protocol", given.protocol)->check(CLI::IsMember({"paper", "blind"}))->capture_default_str();
  app.add_option("--instances", given.instances)->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--suite-seed", given.seed)->capture_default_str();
  app.add_option("--steps", given.steps)->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--radius", given.radius,
                 "of the start around the best pose, as a fraction of the travel, on every axis")
      ->capture_default_str();
  app.add_option("--within", given.within, "excess that counts as reached")->capture_default_str();
  app.add_flag("--every", given.every, "print a line for every trial");
  CLI11_PARSE(app, count, words);
  try {
    relign::run(given);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
