#include "cli/expected_time.h"

#include <algorithm>

#include "cli/progress.h"
#include "records/specification.h"
#include "runner/stations.h"
#include "trials/run_cost.h"

namespace relign::cli {
namespace {

// Of a method that recommends poses where it has been; the error of a pose is computed once. Methods with a model take
// up to 2.
constexpr double kNoiseFreePerStep = 1.3;

// The baseline that moves once, whatever its budget.
bool moves_once(const suites::AlgorithmEntry& algorithm) { return algorithm.choice.plugin->id == "home"; }

// The workers' warnings would repeat those of the scene that is checked.
plugin_host::HostServices quiet_services(Context& context) {
  plugin_host::HostServices services = context.services(1);
  services.log = [](int, const std::string&) {};
  return services;
}

}  // namespace

std::string ExpectedTime::text() const {
  if (!seconds) return "unknown: set by the hardware station (one trial at a time)";
  return "about " + duration_text(std::max(1.0, *seconds)) + " on " + std::to_string(workers) +
         (workers == 1 ? " core" : " cores") +
         " (captures, ground truth and optima, timed now with all cores busy; without the algorithms' own time, "
         "pretraining, pictures and the report)";
}

ExpectedTime expected_time(Context& context, const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts,
                           unsigned workers) {
  ExpectedTime expected;
  expected.workers = workers;
  expected.seconds = 0;
  const std::size_t instances = suite.levels.size() * suite.instances;
  for (std::size_t i = 0; i < suite.scenes.size(); ++i) {
    trials::RunCost cost;
    if (facts[i].owns_stage) {
      expected.seconds.reset();
    } else {
      const trials::Criteria criteria =
          trials::criteria_of(records::specification_of(suite.spec, facts[i].spec, facts[i].score), facts[i]);
      cost = trials::measure_run_cost(suite.scenes[i].choice, suite.levels.front().choice, criteria,
                                      quiet_services(context), workers);
    }
    double seconds = suite.algorithms.empty() ? 0 : static_cast<double>(instances) * cost.instance;
    for (const suites::AlgorithmEntry& algorithm : suite.algorithms) {
      if (!runner::can_run_on(algorithm, facts[i])) continue;
      expected.trials += instances;
      expected.frames += instances * (std::size_t{algorithm.steps} + 1);
      const unsigned steps = moves_once(algorithm) ? 1 : algorithm.steps;
      seconds += static_cast<double>(instances) * (steps + 1.0) *
                 (cost.capture + kNoiseFreePerStep * cost.noise_free + cost.judging);
    }
    if (expected.seconds) *expected.seconds += seconds / workers;
  }
  return expected;
}

}  // namespace relign::cli
