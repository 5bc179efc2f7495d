// Benefit of sources on the authors' benchmark family: Hartmann6 with random weights, 120 source samples, noise 0.1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "conformance/fake_trial.h"
#include "plugin_host/objects.h"
#include "search.hpp"
#include "source_fit.hpp"
#include "surrogates/candidates.hpp"

namespace transfer_gp {
namespace {

struct Hartmann6 {
  double alpha[4];

  static Hartmann6 drawn(relign::Random& random) {
    return {
        {random.uniform(1.00, 1.02), random.uniform(1.18, 1.20), random.uniform(2.8, 3.0), random.uniform(3.2, 3.4)}};
  }
  double operator()(const Vector& x) const {
    constexpr double a[4][6] = {
        {10, 3, 17, 3.5, 1.7, 8}, {0.05, 10, 17, 0.1, 8, 14}, {3, 3.5, 1.7, 10, 17, 8}, {17, 8, 0.05, 10, 0.1, 14}};
    constexpr double p[4][6] = {{0.1312, 0.1696, 0.5569, 0.0124, 0.8283, 0.5886},
                                {0.2329, 0.4135, 0.8307, 0.3736, 0.1004, 0.9991},
                                {0.2348, 0.1451, 0.3522, 0.2883, 0.3047, 0.6650},
                                {0.4047, 0.8828, 0.8732, 0.5743, 0.1091, 0.0381}};
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
      double inner = 0;
      for (int j = 0; j < 6; ++j) inner += a[i][j] * (x[j] - p[i][j]) * (x[j] - p[i][j]);
      sum -= alpha[i] * std::exp(-inner);
    }
    return sum;
  }
  // The position of the optimum is practically the same for the whole family.
  double lowest() const {
    Vector at(6);
    at << 0.20169, 0.150011, 0.476874, 0.275332, 0.311652, 0.6573;
    return (*this)(at);
  }
};

constexpr double kNoise = 0.1;

SourceData sources(std::uint64_t seed, std::size_t count, std::size_t each, Stacking stacking) {
  relign::Random random(seed, 5);
  SourceData data;
  data.dimensions = 6;
  for (std::size_t number = 0; number < count; ++number) {
    const Hartmann6 family = Hartmann6::drawn(random);
    Source source;
    source.points = surrogates::latin_hypercube(random, 6, each);
    source.merits.resize(static_cast<Eigen::Index>(each));
    for (Eigen::Index i = 0; i < source.merits.size(); ++i)
      source.merits[i] = family(source.points.col(i)) + kNoise * random.normal();
    data.sources.push_back(std::move(source));
  }
  const SourceModel model = fit_in_turn(data, Shape::rbf, stacking);
  relign::Random places(0, 1);
  data.candidates = make_candidates(model, surrogates::uniform_points(places, 6, 2000));
  data.finished = true;
  return data;
}

// Regret of the recommendation after each step, from a random start.
std::vector<double> regrets(const SourceData& data, Stacking stacking, std::uint64_t seed, int steps) {
  relign::Random random(seed, 6);
  const Hartmann6 target = Hartmann6::drawn(random);
  SearchSetup setup;
  setup.stacking = stacking;
  setup.candidates = 2000;
  Search search(data, setup, seed);
  std::vector<double> values;
  Vector at = surrogates::uniform_point(random, 6);
  for (int step = 0; step <= steps; ++step) {
    search.tell(at, target(at) + kNoise * random.normal());
    values.push_back(target(search.best()) - target.lowest());
    at = search.ask();
  }
  return values;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

TEST(TransferGpHartmann6, SourcesReduceRegretAtStepTen) {
  constexpr int kSeeds = 7;
  std::vector<double> with, without;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    with.push_back(regrets(sources(seed, 3, 40, Stacking::exact), Stacking::exact, seed, 10).back());
    SourceData nothing;
    nothing.dimensions = 6;
    without.push_back(regrets(nothing, Stacking::exact, seed, 10).back());
  }
  std::printf("median regret at step 10: %.3f with sources, %.3f without\n", median(with), median(without));
  EXPECT_LT(median(with), median(without));
}

#ifdef RELIGN_BO_GP
// Regret of bo-gp from the same start with the same noise; without a recommendation that of its best measured pose.
double regret_of_bo_gp(std::uint64_t seed, std::uint32_t steps) {
  using namespace relign;
  Random random(seed, 6);
  const Hartmann6 target = Hartmann6::drawn(random);
  plugin_host::Catalog catalog;
  catalog.add(RELIGN_BO_GP);
  conformance::FakeSetup setup;
  setup.axes = 6;
  setup.observes = RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_BOX | RELIGN_OBSERVES_START;
  setup.lower.assign(6, 0.0);
  setup.upper.assign(6, 1.0);
  setup.budget = steps;
  setup.seed = seed;
  const Vector start = surrogates::uniform_point(random, 6);
  setup.start.assign(start.begin(), start.end());
  double lowest = std::numeric_limits<double>::infinity();
  conformance::Pose best = setup.start;
  const auto at = [](const conformance::Pose& pose) { return Eigen::Map<const Vector>(pose.data(), 6); };
  setup.merit = [&](const conformance::Pose& pose, std::uint32_t) {
    const double merit = target(at(pose)) + kNoise * random.normal();
    if (merit < lowest) best = pose;
    lowest = std::min(lowest, merit);
    return merit;
  };
  conformance::FakeTrial trial(setup);
  plugin_host::Algorithm(catalog.resolve_or_throw(plugin_host::Kind::optimizer, "bo-gp"), {}).run(trial.handle());
  if (!trial.recommendations.empty()) best = trial.recommendations.back().pose;
  return target(at(best)) - target.lowest();
}

TEST(TransferGpHartmann6, HasLowerRegretThanBoGpAtStepTen) {
  constexpr int kSeeds = 7;
  for (const Stacking stacking : {Stacking::exact, Stacking::boosted}) {
    std::vector<double> ours, theirs;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      ours.push_back(regrets(sources(seed, 3, 40, stacking), stacking, seed, 10).back());
      theirs.push_back(regret_of_bo_gp(seed, 10));
    }
    std::printf("median regret at step 10: %.3f, bo-gp %.3f\n", median(ours), median(theirs));
    EXPECT_LT(median(ours), median(theirs));
  }
}
#endif

}  // namespace
}  // namespace transfer_gp
