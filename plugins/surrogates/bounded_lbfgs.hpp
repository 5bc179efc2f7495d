// Minimises a smooth function in a box: limited-memory BFGS, projected. Small, deterministic and silent, which the
// packaged Fortran L-BFGS-B is not.
#pragma once

#include <functional>
#include <limits>

#include "kernel.hpp"

namespace surrogates {

// Writes the gradient, returns the value. A value that is no finite number is a wall.
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

// Where lower equals upper the coordinate is fixed.
Minimum minimize(const Objective& objective, const Vector& start, const Vector& lower, const Vector& upper,
                 const SearchLimits& limits = {});

}  // namespace surrogates
