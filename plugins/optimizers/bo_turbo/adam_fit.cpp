#include "adam_fit.hpp"

#include <cmath>

namespace bo_turbo {
namespace {

using Array = Eigen::ArrayXd;

constexpr int kSteps = 50;
constexpr double kRate = 0.1;
constexpr double kFirstDecay = 0.9;
constexpr double kSecondDecay = 0.999;
constexpr double kTiny = 1e-8;

}  // namespace

Fitted adam_fit(const surrogates::Likelihood& likelihood, Eigen::Index axes, Eigen::Index points) {
  Array lower = Array::Constant(axes + 2, 0.005), upper = Array::Constant(axes + 2, 2.0);
  Array start = Array::Constant(axes + 2, 0.5);
  lower[0] = 0.05, upper[0] = 20, start[0] = 1;
  lower[axes + 1] = 5e-4, upper[axes + 1] = 0.2, start[axes + 1] = 0.005;

  // Free variables: each hyperparameter is lower + (upper - lower) * sigmoid(x). The last one is the mean.
  const Array share = (start - lower) / (upper - lower);
  Array x = Array::Zero(axes + 3);
  x.head(axes + 2) = (share / (1 - share)).log();
  Array first = Array::Zero(x.size()), second = Array::Zero(x.size());
  Array sigmoid, value;
  const auto evaluate = [&] {
    sigmoid = 1 / (1 + (-x.head(axes + 2)).exp());
    value = lower + (upper - lower) * sigmoid;
  };
  double first_weight = 1, second_weight = 1;
  for (int step = 0; step < kSteps; ++step) {
    evaluate();
    Vector by_theta;
    double by_mean = 0;
    likelihood.log(value.log(), &by_theta, x[axes + 2], &by_mean);
    Array slope(x.size());  // of the loss: minus the log likelihood per point
    slope.head(axes + 2) = -by_theta.array() / value * (upper - lower) * sigmoid * (1 - sigmoid);
    slope[axes + 2] = -by_mean;
    slope /= static_cast<double>(points);
    first = kFirstDecay * first + (1 - kFirstDecay) * slope;
    second = kSecondDecay * second + (1 - kSecondDecay) * slope.square();
    first_weight *= kFirstDecay;
    second_weight *= kSecondDecay;
    x -= kRate / (1 - first_weight) * first / ((second / (1 - second_weight)).sqrt() + kTiny);
  }
  evaluate();
  return {value.log(), x[axes + 2]};
}

}  // namespace bo_turbo
