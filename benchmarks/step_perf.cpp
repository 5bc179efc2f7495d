// Overhead of the harness per step: whole trials of an algorithm and a scene without computation, without records. The
// counter is "step", in seconds; it includes the start and end of a trial, divided by its steps.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "plugin_host/objects.h"
#include "trials/trial.h"

namespace {

namespace fs = std::filesystem;
namespace trials = relign::trials;
using relign::Json;
using relign::plugin_host::Catalog;
using relign::plugin_host::Kind;

void trial(benchmark::State& state, const std::string& walker, bool truth, unsigned steps) {
  const fs::path here = RELIGN_BENCHMARK_PLUGINS;
  Catalog catalog;
  const relign::plugin_host::Choice choice =
      catalog.resolve_or_throw(Kind::scene, (here / "null_scene").string(), {{"truth", truth}});
  relign::plugin_host::Scene scene(choice, {});
  trials::ModelScene model(scene, choice, {});
  const trials::SceneFacts facts = trials::read_scene_facts(scene.describe(), "null-scene");
  const relign::plugin_host::Choice algorithm = catalog.resolve_or_throw(Kind::optimizer, walker);
  trials::Instance instance;
  instance.perturbations.start = {0.4, 0.45, 0.5, 0.55, 0.6};
  for (int i = 0; i < 25; ++i) instance.perturbations.distortion.push_back(i % 6 == 0 ? 1.0 : 0.01);
  instance.perturbations.elements_json = "{}";
  relign::plugin_host::MountedAssembly assembly = scene.mount("{}");
  catalog.scan(RELIGN_PLUGINS);
  relign::plugin_host::NoiseLevel level(catalog.resolve_or_throw(Kind::noise_level, "rho0"), {});
  const trials::TrialSetup setup{.stage = trials::SimulatedLens{assembly, model, level},
                                 .reference = scene.reference(),
                                 .scene = facts,
                                 .instance = instance,
                                 .algorithm = algorithm,
                                 .terms = {.protocol = trials::Protocol::blind, .budget = steps}};
  for (auto _ : state)
    if (trials::run_trial(setup).end != trials::End::budget_spent) state.SkipWithError("the trial ended early");
  state.counters["step"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * steps,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert, benchmark::Counter::kIs1000);
}

void in_process(benchmark::State& state, bool truth) {
  trial(state, (fs::path(RELIGN_BENCHMARK_PLUGINS) / "null_walker").string(), truth, 10'000);
}
BENCHMARK_CAPTURE(in_process, measured_only, false)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(in_process, with_truth, true)->UseRealTime()->Unit(benchmark::kMillisecond);

void across_processes(benchmark::State& state) { trial(state, RELIGN_NULL_WALKER_PY, false, 20'000); }
BENCHMARK(across_processes)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
