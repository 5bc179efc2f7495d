// Computation of transfer-gp between two moves after pretraining on 10 sources of 100 steps: processor time from the
// response to one step until the request for the next, at a given number of measured points in six axes, through the
// plugin as the host runs it. The start of a trial (reading the pretraining) is measured separately.
#include <benchmark/benchmark.h>

#include <ctime>

#include "conformance/fake_services.h"
#include "plugin_host/objects.h"

namespace {

using namespace relign::conformance;
namespace plugin_host = relign::plugin_host;

constexpr std::uint32_t kAxes = 6, kSources = 10, kSamples = 100, kWindow = 5;

plugin_host::Choice choice_of(const std::string& id) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_TRANSFER_GP));
  return catalog.resolve_or_throw(plugin_host::Kind::optimizer, id);
}

FakeSetup setup_on(std::uint64_t lens, FakePretraining& pretraining) {
  FakeSetup setup;
  setup.axes = kAxes;
  setup.seed = lens;
  setup.pretraining = &pretraining;
  Pose optimum(kAxes);
  relign::Random random(lens, 9);
  for (double& coordinate : optimum) coordinate = 0.1 * random.normal();
  setup.merit = [optimum, lens](const Pose& pose, std::uint32_t step) {
    return bowl(pose, optimum) + 0.002 * relign::Random(lens, step).normal();
  };
  return setup;
}

void run(const plugin_host::Choice& choice, FakeSetup& setup) {
  FakeTrial trial(setup);
  const FakeServices services(choice, trial);
  plugin_host::Algorithm(choice, {}).run(trial.handle());
}

const FakePretraining& learnt(const std::string& id) {
  static std::map<std::string, FakePretraining> known;
  FakePretraining& pretraining = known[id];
  if (pretraining.bytes) return pretraining;
  pretraining.active = true;
  pretraining.sources = kSources;
  for (; pretraining.source < kSources; ++pretraining.source) {
    FakeSetup setup = setup_on(pretraining.source, pretraining);
    setup.budget = kSamples;
    run(choice_of(id), setup);
  }
  pretraining.active = false;
  return pretraining;
}

void proposal(benchmark::State& state, const std::string& id) {
  const plugin_host::Choice choice = choice_of(id);
  FakePretraining pretraining = learnt(id);
  const auto points = static_cast<std::uint32_t>(state.range(0));
  std::uint64_t lens = kSources;
  for (auto _ : state) {
    FakeSetup setup = setup_on(lens++, pretraining);
    setup.budget = points + kWindow - 1;
    std::clock_t answered = std::clock(), computed = 0;
    setup.merit = [&, merit = setup.merit](const Pose& pose, std::uint32_t step) {
      if (step >= points) computed += std::clock() - answered;
      const double value = merit(pose, step);
      answered = std::clock();
      return value;
    };
    run(choice, setup);
    state.SetIterationTime(static_cast<double>(computed) / CLOCKS_PER_SEC / kWindow);
  }
}

// Reading, checking and factorising the pretraining, and the first proposal.
void start(benchmark::State& state, const std::string& id) {
  const plugin_host::Choice choice = choice_of(id);
  FakePretraining pretraining = learnt(id);
  FakeSetup setup = setup_on(kSources, pretraining);
  setup.budget = 0;
  for (auto _ : state) {
    const std::clock_t begin = std::clock();
    run(choice, setup);
    state.SetIterationTime(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
}

#define RELIGN_TRANSFER(name, id)       \
  BENCHMARK_CAPTURE(proposal, name, id) \
      ->Arg(20)                         \
      ->Arg(50)                         \
      ->UseManualTime()                 \
      ->Unit(benchmark::kMillisecond)   \
      ->Iterations(8);                  \
  BENCHMARK_CAPTURE(start, name, id)->UseManualTime()->Unit(benchmark::kMillisecond)->Iterations(8)
RELIGN_TRANSFER(transfer_gp, "transfer-gp");
RELIGN_TRANSFER(transfer_gp_mhgp, "transfer-gp-mhgp");
RELIGN_TRANSFER(transfer_gp_bhgp, "transfer-gp-bhgp");

}  // namespace
