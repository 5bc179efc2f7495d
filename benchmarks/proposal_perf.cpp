// Computation of optimizers between two captures: trials on a function that costs nothing, in six axes. Processor time
// per proposal, from one merit to the next request; random initial points bring the model to its size.
#include <benchmark/benchmark.h>

#include <ctime>

#include "conformance/fake_trial.h"
#include "plugin_host/objects.h"

namespace {

using relign::conformance::FakeSetup;
using relign::conformance::FakeTrial;
using relign::conformance::Pose;

constexpr unsigned kProposals = 5;  // per trial, once the model has its size

void proposal(benchmark::State& state, const std::string& plugin, const std::string& preset, unsigned points) {
  relign::plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGINS "/") + plugin);
  const auto choice =
      catalog.resolve_or_throw(relign::plugin_host::Kind::optimizer, preset, {{"initial_points", points - 1}});
  FakeSetup setup;
  setup.axes = 6;
  setup.budget = points - 1 + kProposals;  // the capture at the start pose is a point too
  std::clock_t answered = 0;
  std::clock_t computed = 0;
  setup.merit = [&](const Pose& pose, std::uint32_t step) {
    if (step >= points) computed += std::clock() - answered;
    const double merit = relign::conformance::bowl(pose, Pose(6, 0.1));
    answered = std::clock();
    return merit;
  };
  for (auto _ : state) {
    computed = 0;
    FakeTrial trial(setup);
    relign::plugin_host::Algorithm(choice, {}).run(trial.handle());
    state.SetIterationTime(static_cast<double>(computed) / CLOCKS_PER_SEC / kProposals);
    ++setup.seed;
  }
}

void forest(benchmark::State& state, const std::string& preset) {
  proposal(state, "bo_forest", preset, static_cast<unsigned>(state.range(0)));
}
BENCHMARK_CAPTURE(forest, rf, "bo-rf")->Arg(20)->Arg(50)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(forest, et, "bo-et")->Arg(20)->Arg(50)->UseManualTime()->Unit(benchmark::kMillisecond);

void process(benchmark::State& state, const std::string& preset) {
  proposal(state, "bo_gp", preset, static_cast<unsigned>(state.range(0)));
}
BENCHMARK_CAPTURE(process, gp, "bo-gp")->Arg(20)->Arg(50)->Arg(95)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(process, gp_tuned, "bo-gp-tuned")->Arg(20)->Arg(50)->UseManualTime()->Unit(benchmark::kMillisecond);

void trust_region(benchmark::State& state) {
  proposal(state, "bo_turbo", "bo-turbo", static_cast<unsigned>(state.range(0)));
}
BENCHMARK(trust_region)->Arg(20)->Arg(50)->Arg(95)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
