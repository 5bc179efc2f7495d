// Acquisition functions of the predicted mean and standard deviation, as costs to be minimised.
#pragma once

#include "gaussian_process.hpp"

namespace surrogates {

enum class Acquisition { expected_improvement, lower_bound, probability, log_expected_improvement };

struct AcquisitionSetup {
  double incumbent = 0;  // merit to improve on
  double xi = 0.01;      // least improvement, in units of the merit
  double kappa = 1.96;   // lower bound: standard deviations below the mean
};

struct Cost {
  double value = 0;
  double by_mean = 0;  // derivatives
  double by_deviation = 0;
};

// The logarithm of expected improvement has a usable gradient where expected improvement itself underflows (Ament et
// al., 2023).
Cost acquisition_cost(Acquisition kind, const AcquisitionSetup& setup, double mean, double deviation);

// Gradient by the chain rule through the model.
double acquisition_cost(Acquisition kind, const AcquisitionSetup& setup, const Prediction& predicted, Vector& gradient);

// Element-wise.
Vector acquisition_costs(Acquisition kind, const AcquisitionSetup& setup, const Vector& means,
                         const Vector& deviations);

}  // namespace surrogates
