// Preprocessing of merits for surrogates: standardisation and replacement of non-finite values.
#pragma once

#include <vector>

#include "kernel.hpp"

namespace surrogates {

// Scales values to mean 0 and (population) standard deviation 1. Equal values are only shifted.
struct Standard {
  Standard() = default;  // identity
  explicit Standard(const Vector& values);
  Vector apply(const Vector& values) const { return (values.array() - mean) / scale; }
  double mean = 0;
  double scale = 1;
};

// False for NaN, infinity, and values whose square would overflow.
bool is_usable(double merit);
// Replaces unusable merits by the worst usable one, or by 0 if there is none.
Vector usable_merits(const std::vector<double>& merits);

}  // namespace surrogates
