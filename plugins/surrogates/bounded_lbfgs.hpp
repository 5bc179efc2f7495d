// Minimises a smooth function in a box by projected L-BFGS. Small, deterministic and silent, unlike the packaged
// Fortran L-BFGS-B.
#pragma once

#include <functional>
#include <limits>

#include "kernel.hpp"

namespace surrogates {

// Writes the gradient, returns the value. A non-finite value makes the line search shorten its step.
using Objective = std::function<double(const Vector& at, Vector& gradient)>;

// The defaults of SciPy's L-BFGS-B.
struct SearchLimits {
  int iterations = 15000;
  double gradient = 1e-5;                                          // largest entry of the projected gradient
  double decrease = 1e7 * std::numeric_limits<double>::epsilon();  // relative, from one iterate to the next
};

struct Minimum {
  Vector at;
  double value = std::numeric_limits<double>::infinity();
};

// A coordinate whose bounds are equal is fixed.
Minimum minimize(const Objective& objective, const Vector& start, const Vector& lower, const Vector& upper,
                 const SearchLimits& limits = {});

}  // namespace surrogates
