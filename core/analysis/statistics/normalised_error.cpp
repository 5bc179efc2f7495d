#include "statistics/normalised_error.h"

#include <algorithm>
#include <cmath>

#include "statistics/band.h"
#include "statistics/excess.h"

namespace relign::statistics {

namespace {

// Between start and resolution; NaN if the start is within the resolution.
double decades_of(double start_excess, double resolution) {
  return start_excess > resolution ? std::log(start_excess / resolution) : kMissing;
}

double share_of(double decades, double excess, double resolution) {
  if (std::isnan(excess) || std::isnan(decades)) return kMissing;
  return std::clamp(std::log(std::max(excess, resolution) / resolution) / decades, 0.0, 1.0);
}

}  // namespace

double normalised_error(double excess, double start_excess, double resolution) {
  return share_of(decades_of(start_excess, resolution), excess, resolution);
}

std::vector<double> normalised_errors(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Rule rule,
                                      const SceneScore& score) {
  std::vector<double> errors;
  errors.reserve(steps.size());
  if (steps.empty()) return errors;
  const double start = steps.front().step == 0 ? score.shown(steps.front().commanded_mse - own_optimum_mse) : kMissing;
  const double decades = decades_of(start, score.resolution);
  for (const double excess : excess_errors(steps, own_optimum_mse, rule, score))
    errors.push_back(share_of(decades, excess, score.resolution));
  return errors;
}

double area_under(const std::vector<double>& errors, unsigned budget) {
  if (errors.empty() || budget == 0) return kMissing;
  double sum = 0;
  for (unsigned step = 1; step <= budget; ++step) sum += errors[std::min<std::size_t>(step, errors.size() - 1)];
  return sum / budget;
}

}  // namespace relign::statistics
