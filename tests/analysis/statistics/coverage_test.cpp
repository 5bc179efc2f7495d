// Coverage of 95 % intervals in simulated studies, and the false positive rate of an A/A comparison (one algorithm
// under two names). RELIGN_SIMULATIONS=2000 runs the long form with 10,000 resamples, whose table is in
// docs/statistics.md (a minute or two); RELIGN_COVERAGE_TABLE=1 prints the table.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "statistics/aggregate.h"
#include "statistics/bootstrap.h"
#include "statistics/paired.h"
#include "statistics/proportion.h"
#include "statistics/simulated.h"
#include "statistics/survival.h"

namespace relign::statistics {
namespace {

using test::Algorithm;
using test::Distribution;

struct Size {
  int simulations = 800;
  std::size_t resamples = 1000;
};

Size size() {
  const char* wanted = std::getenv("RELIGN_SIMULATIONS");
  return wanted ? Size{std::atoi(wanted), kResamples} : Size{};
}

void print(const char* what, const std::string& of, std::size_t n, double percent, double other) {
  if (std::getenv("RELIGN_COVERAGE_TABLE") == nullptr) return;
  std::printf("| %s | %s | %zu | %.1f %% | %.1f %% |\n", what, of.c_str(), n, percent, other);
  std::fflush(stdout);
}

// Percentage of simulations whose band contains the true value.
double coverage(const Distribution& distribution, std::size_t n, const OrderStatistic& statistic, double truth) {
  const Resampling resampling(n, size().resamples, 7);
  int held = 0;
  for (int simulation = 0; simulation < size().simulations; ++simulation) {
    Random random(1, static_cast<std::uint64_t>(simulation));
    std::vector<double> values(n);
    for (double& value : values) value = distribution.draw(random);
    const Interval interval = bands(resampling, {values}, statistic).front().interval;
    // Bands may end at a tie, up to the rounding of a weighted sum.
    held += interval.low <= truth + 1e-12 && truth <= interval.high + 1e-12 ? 1 : 0;
  }
  return 100.0 * held / size().simulations;
}

// 93 to 97 % at n = 100, widened by three standard errors of the simulation; values on a grid make bands conservative.
TEST(Coverage, OfMedianAndIqmIs95Percent) {
  const double noise = 300 * std::sqrt(0.05 * 0.95 / size().simulations);
  for (const Distribution& distribution : test::distributions()) {
    const bool grid = distribution.name.find("grid") != std::string::npos;
    for (const std::size_t n : {100U, 10U}) {
      const double median = coverage(distribution, n, OrderStatistic::median(), distribution.median);
      const double iqm = coverage(distribution, n, OrderStatistic::iqm(), distribution.iqm);
      print("coverage: median, IQM", distribution.name, n, median, iqm);
      const double least = n == 100 ? 93.5 : 90, most = n == 100 && !grid ? 96.5 : 100;
      EXPECT_GT(iqm, least - noise) << distribution.name << " " << n;
      EXPECT_LT(iqm, most + noise) << distribution.name << " " << n;
      EXPECT_GT(median, least - noise) << distribution.name << " " << n;
      EXPECT_LT(median, most + noise) << distribution.name << " " << n;
    }
  }
}

struct Different {
  double by_band = 0, by_test = 0;  // percent of the simulations
};

Different different(const Algorithm& algorithm, std::size_t n, const OrderStatistic& statistic) {
  const Resampling resampling(n, size().resamples, 7);
  PairedOptions options;
  options.statistic = statistic;
  Different result;
  for (int simulation = 0; simulation < size().simulations; ++simulation) {
    Random random(2, static_cast<std::uint64_t>(simulation));
    std::vector<double> first(n), second(n);
    for (std::size_t instance = 0; instance < n; ++instance) {
      const double hard = 0.01 * std::exp(random.normal());
      first[instance] = algorithm.run(hard, random);
      second[instance] = algorithm.run(hard, random);
    }
    const PairedComparison comparison = compare_paired(first, second, resampling, options);
    const bool decided = comparison.verdict == Verdict::better || comparison.verdict == Verdict::worse;
    result.by_band += (decided ? 100.0 : 0) / size().simulations;
    result.by_test += (comparison.test.p < 0.05 ? 100.0 : 0) / size().simulations;
  }
  return result;
}

TEST(Coverage, ASecondNameOfAnAlgorithmIsNotSignificant) {
  const double noise = 300 * std::sqrt(0.05 * 0.95 / size().simulations);
  for (const Algorithm& algorithm : test::algorithms()) {
    for (const std::size_t n : {100U, 10U}) {
      const Different iqm = different(algorithm, n, OrderStatistic::iqm());
      const Different median = different(algorithm, n, OrderStatistic::median());
      print("A/A different: median, IQM", algorithm.name, n, median.by_band, iqm.by_band);
      print("A/A different: Wilcoxon", algorithm.name, n, iqm.by_test, iqm.by_test);
      for (const double share : {iqm.by_band, median.by_band}) {
        EXPECT_LT(share, (n == 100 ? 6.5 : 10) + noise) << algorithm.name << " " << n;
      }
      EXPECT_LT(iqm.by_test, 5 + noise) << algorithm.name << " " << n;
    }
  }
}

// Percentage of simulations whose band contains 0: value = training + instance + noise.
double coverage_of_trainings(std::size_t trainings, double training_sigma, int simulations) {
  constexpr std::size_t kInstances = 100;
  const StratifiedResampling resampling({kInstances}, size().resamples, 7);
  Parallel parallel(1);
  int held = 0;
  for (int simulation = 0; simulation < simulations; ++simulation) {
    Random random(3, static_cast<std::uint64_t>(simulation));
    std::vector<double> instance(kInstances), values;
    for (double& value : instance) value = random.normal();
    for (std::size_t training = 0; training < trainings; ++training) {
      const double level = training_sigma * random.normal();
      for (const double value : instance) values.push_back(level + value + 0.5 * random.normal());
    }
    const StratifiedValues errors = {trainings, {values}};
    const Interval interval = aggregate(resampling, {{errors, errors}}, {}, parallel).methods.front().iqm.interval;
    held += interval.low <= 0 && 0 <= interval.high ? 1 : 0;
  }
  return 100.0 * held / simulations;
}

// Conservative if instances vary more than trainings.
TEST(Coverage, OfTrainingsIsAtLeast95Percent) {
  const int simulations = size().simulations / 4;
  const double noise = 300 * std::sqrt(0.05 * 0.95 / simulations);
  for (const std::size_t trainings : {5U, 10U}) {
    const double alike = coverage_of_trainings(trainings, 0.1, simulations);
    const double apart = coverage_of_trainings(trainings, 1, simulations);
    print("coverage: IQM of trainings, sigma 0.1, 1", "100 instances", trainings, alike, apart);
    EXPECT_GT(alike, 95 - noise) << trainings;
    EXPECT_GT(apart, 93 - noise) << trainings;
  }
}

// Each step succeeds with probability 4 %, the budget is 30 steps: expected 25 steps, median 17.
TEST(Coverage, OfStepsToTargetIs95Percent) {
  constexpr double kChance = 0.04;
  constexpr int kBudget = 30;
  const double noise = 300 * std::sqrt(0.05 * 0.95 / size().simulations);
  const auto holds = [](const Interval& interval, double truth) {
    return interval.low <= truth && truth <= interval.high ? 100.0 / size().simulations : 0;
  };
  for (const std::size_t n : {100U, 10U}) {
    const Resampling resampling(n, size().resamples, 7);
    double expected = 0, median = 0, survival = 0, successes = 0;
    for (int simulation = 0; simulation < size().simulations; ++simulation) {
      Random random(4, static_cast<std::uint64_t>(simulation));
      std::vector<TargetTime> trials(n);
      for (TargetTime& trial : trials) {
        while (!trial.reached && trial.steps < kBudget) {
          ++trial.steps;
          trial.reached = random.uniform() < kChance;
        }
      }
      const ExpectedSteps steps = expected_steps(trials, resampling);
      const std::vector<SurvivalPoint> curve = kaplan_meier(trials);
      const Band rate = success_rate(steps.successes, n);
      expected += holds(steps.interval, 1 / kChance);
      median += holds(median_steps(curve).interval, 17);
      successes += holds(rate.interval, 1 - std::pow(1 - kChance, kBudget));
      SurvivalPoint at_ten;
      at_ten.interval = {1, 1};
      for (const SurvivalPoint& point : curve) at_ten = point.steps <= 10 ? point : at_ten;
      survival += holds(at_ten.interval, std::pow(1 - kChance, 10));
    }
    print("coverage: expected steps, success rate", "4 % a step", n, expected, successes);
    print("coverage: median steps, Kaplan-Meier at 10", "4 % a step", n, median, survival);
    for (const double percent : {expected, successes, median, survival}) {
      EXPECT_GT(percent, (n == 100 ? 93.5 : 88) - noise) << n;
      EXPECT_LT(percent, (n == 100 ? 97.5 : 100) + noise) << n;
    }
  }
}

}  // namespace
}  // namespace relign::statistics
