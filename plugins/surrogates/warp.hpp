// Merits bent towards a normal distribution, as a Gaussian process wants them: far poses often have merits of quite
// another size than near ones.
#pragma once

#include "kernel.hpp"

namespace surrogates {

// Yeo and Johnson (Biometrika 87, 2000): a monotonic power law on both sides of 0; power 1 leaves values as they are.
double yeo_johnson(double value, double power);

// The power in [-1, 3] under which the standardised values look most normal.
double best_power(const Vector& standardised);

// Standardised, bent by their best power. The same for values that differ by an offset and a positive scale.
Vector warped(const Vector& values);

}  // namespace surrogates
