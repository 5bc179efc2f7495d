// What a pose is worth measuring, from the mean and deviation that a model predicts there. As costs: smaller is more
// worth.
#pragma once

#include "gaussian_process.hpp"

namespace surrogates {

enum class Acquisition { expected_improvement, lower_bound, probability, log_expected_improvement };

struct AcquisitionSetup {
  double incumbent = 0;  // the merit to beat
  double xi = 0.01;      // by how much, in units of the merit
  double kappa = 1.96;   // deviations below the mean
};

struct Cost {
  double value = 0;
  double by_mean = 0;  // derivatives
  double by_deviation = 0;
};

// The logarithm of expected improvement keeps its slope where the improvement itself is rounded to nothing (Ament et
// al., 2023).
Cost acquisition_cost(Acquisition kind, const AcquisitionSetup& setup, double mean, double deviation);

// With the chain rule through the model.
double acquisition_cost(Acquisition kind, const AcquisitionSetup& setup, const Prediction& told, Vector& gradient);

// One cost per entry.
Vector acquisition_costs(Acquisition kind, const AcquisitionSetup& setup, const Vector& means,
                         const Vector& deviations);

}  // namespace surrogates
