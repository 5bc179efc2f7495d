// Yeo-Johnson transform of merits towards a normal distribution, which a Gaussian process assumes: merits of distant
// poses are often orders of magnitude larger than those of near ones.
#pragma once

#include "kernel.hpp"

namespace surrogates {

// Yeo and Johnson, Biometrika 87 (2000): a monotonic power law on both sides of 0; power 1 is the identity.
double yeo_johnson(double value, double power);

// The maximum likelihood power in [-1, 3] for standardised values.
double best_power(const Vector& standardised);

// Standardises values and transforms them by their best power. Invariant to offset and positive scale.
Vector warped(const Vector& values);

}  // namespace surrogates
