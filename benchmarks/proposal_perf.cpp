// What an optimizer thinks between two moves: processor time (a busy machine matters less) from the answer to one step
// until the request for the next, at so many measured points in six axes (Hartmann's function), through the plugin as
// the host runs it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

#include "plugin_check/fake_conversation.h"
#include "plugin_host/objects.h"

namespace {

using relign::plugin_check::FakeConversation;
using relign::plugin_check::FakeSetup;
using relign::plugin_check::Pose;
namespace plugin_host = relign::plugin_host;

constexpr std::uint32_t kWindow = 5;  // proposals averaged

double hartmann6(const Pose& x) {
  static const double a[4][6] = {
      {10, 3, 17, 3.5, 1.7, 8}, {0.05, 10, 17, 0.1, 8, 14}, {3, 3.5, 1.7, 10, 17, 8}, {17, 8, 0.05, 10, 0.1, 14}};
  static const double p[4][6] = {{0.1312, 0.1696, 0.5569, 0.0124, 0.8283, 0.5886},
                                 {0.2329, 0.4135, 0.8307, 0.3736, 0.1004, 0.9991},
                                 {0.2348, 0.1451, 0.3522, 0.2883, 0.3047, 0.6650},
                                 {0.4047, 0.8828, 0.8732, 0.5743, 0.1091, 0.0381}};
  static const double c[4] = {1, 1.2, 3, 3.2};
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    double exponent = 0;
    for (int j = 0; j < 6; ++j) exponent += a[i][j] * std::pow(x[static_cast<std::size_t>(j)] - p[i][j], 2);
    sum -= c[i] * std::exp(-exponent);
  }
  return sum;
}

void proposal(benchmark::State& state, const std::string& folder, const std::string& id) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGINS) + "/" + folder);
  const plugin_host::Choice choice = catalog.resolve_or_throw(plugin_host::Kind::optimizer, id);
  const auto points = static_cast<std::uint32_t>(state.range(0));
  FakeSetup setup;
  setup.axes = 6;
  setup.lower = Pose(6, 0.0);
  setup.upper = Pose(6, 1.0);
  setup.budget = points + kWindow / 2 + 1;
  for (auto _ : state) {
    std::clock_t answered = 0;
    double seconds = 0;
    ++setup.seed;
    setup.merit = [&](const Pose& pose, std::uint32_t step) {
      if (step > points - kWindow / 2)
        seconds += static_cast<double>(std::clock() - answered) / CLOCKS_PER_SEC / kWindow;
      const double merit = hartmann6(pose);
      answered = std::clock();
      return merit;
    };
    FakeConversation conversation(setup);
    plugin_host::Algorithm(choice, {}).run(conversation.talk());
    state.SetIterationTime(seconds);
  }
}
BENCHMARK_CAPTURE(proposal, bo_gp, "bo_gp", "bo-gp")
    ->Arg(20)
    ->Arg(50)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);
BENCHMARK_CAPTURE(proposal, bo_gp_tuned, "bo_gp", "bo-gp-tuned")
    ->Arg(20)
    ->Arg(50)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);

}  // namespace
