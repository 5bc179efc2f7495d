// Merits as surrogates take them: brought to a common scale, and finite.
#pragma once

#include <vector>

#include "kernel.hpp"

namespace surrogates {

// Values brought to mean 0 and (population) standard deviation 1; equal values keep their scale.
struct Standard {
  Standard() = default;  // leaves values as they are
  explicit Standard(const Vector& values);
  Vector apply(const Vector& values) const { return (values.array() - mean) / scale; }
  double mean = 0;
  double scale = 1;
};

// A merit that is no usable number (NaN, infinite, or so large that its square would overflow) counts as bad as the
// worst one that is; 0 where none is.
bool is_usable(double merit);
Vector usable_merits(const std::vector<double>& merits);

}  // namespace surrogates
