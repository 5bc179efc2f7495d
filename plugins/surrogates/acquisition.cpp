#include "acquisition.hpp"

#include <cmath>

namespace surrogates {
namespace {

const double kRootTwoPi = std::sqrt(2 * std::acos(-1.0));
constexpr double kNothing = 1e10;  // stands for -log(0)

// -log(deviation h(z)), h(z) = density(z) + z share(z), with the normal density and distribution function (share).
Cost log_improvement(double improvement, double deviation) {
  if (!(deviation > 0)) return {improvement > 0 ? -std::log(improvement) : kNothing, 0, 0};
  const double z = improvement / deviation;
  double log_h = 0;
  double density_ratio = 0;  // density / h
  double share_ratio = 0;    // share / h
  if (z > -5) {
    const double density = std::exp(-0.5 * z * z) / kRootTwoPi;
    const double share = 0.5 * std::erfc(-z / std::sqrt(2.0));
    const double h = density + z * share;
    log_h = std::log(h);
    density_ratio = density / h;
    share_ratio = share / h;
  } else {
    // Continued fraction share / density = 1 / (t + 1 / (t + 2 / (t + 3 / ...))), t = -z. With s the fraction after the
    // first t, h / density = s / (t + s), which avoids cancellation.
    const double t = -z;
    double tail = 0;
    for (int term = 60; term >= 1; --term) tail = term / (t + tail);
    density_ratio = (t + tail) / tail;
    share_ratio = 1 / tail;
    log_h = -0.5 * t * t - std::log(kRootTwoPi) - std::log(density_ratio);
  }
  return {-std::log(deviation) - log_h, share_ratio / deviation, -density_ratio / deviation};
}

}  // namespace

Cost acquisition_cost(Acquisition kind, const AcquisitionSetup& setup, double mean, double deviation) {
  if (kind == Acquisition::lower_bound) return {mean - setup.kappa * deviation, 1, -setup.kappa};
  const double improvement = setup.incumbent - setup.xi - mean;
  if (kind == Acquisition::log_expected_improvement) return log_improvement(improvement, deviation);
  if (!(deviation > 0)) return {};  // the value there is known
  const double scaled = improvement / deviation;
  const double density = std::exp(-0.5 * scaled * scaled) / kRootTwoPi;
  const double share = 0.5 * std::erfc(-scaled / std::sqrt(2.0));
  if (kind == Acquisition::expected_improvement) return {-(improvement * share + deviation * density), share, -density};
  return {-share, density / deviation, density * scaled / deviation};
}

double acquisition_cost(Acquisition kind, const AcquisitionSetup& setup, const Prediction& predicted,
                        Vector& gradient) {
  const Cost cost = acquisition_cost(kind, setup, predicted.mean, predicted.deviation);
  gradient = cost.by_mean * predicted.mean_gradient + cost.by_deviation * predicted.deviation_gradient;
  return cost.value;
}

Vector acquisition_costs(Acquisition kind, const AcquisitionSetup& setup, const Vector& means,
                         const Vector& deviations) {
  Vector costs(means.size());
  for (Eigen::Index i = 0; i < means.size(); ++i)
    costs[i] = acquisition_cost(kind, setup, means[i], deviations[i]).value;
  return costs;
}

}  // namespace surrogates
