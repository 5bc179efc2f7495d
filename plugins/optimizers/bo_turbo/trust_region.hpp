// The trust region of TuRBO-1 with batches of one: its side length and its sides in the unit cube.
#pragma once

#include <cstddef>

#include "surrogates/kernel.hpp"

namespace bo_turbo {

using surrogates::Matrix;
using surrogates::Vector;

constexpr double kFirstLength = 0.8;
constexpr double kLeastLength = 1.0 / 128;
constexpr double kLargestLength = 1.6;
constexpr std::size_t kSuccessTolerance = 3;

// A success lowers the best merit by more than a thousandth of its magnitude.
bool is_success(double merit, double best);

struct Sides {
  Vector lower;
  Vector upper;
};

class TrustRegion {
 public:
  explicit TrustRegion(std::size_t axes);

  // Doubles the length after kSuccessTolerance successes in a row, halves it after failure_tolerance_ failures.
  void record(bool success);
  double length() const { return length_; }
  bool collapsed() const { return length_ < kLeastLength; }

  // Around the centre, each side proportional to the kernel's length scale of its axis, the volume that of a cube of
  // length(); cut to the unit cube.
  Sides sides(const Vector& centre, const Vector& length_scales) const;

 private:
  std::size_t failure_tolerance_;
  double length_ = kFirstLength;
  std::size_t successes_ = 0;  // in a row
  std::size_t failures_ = 0;
};

}  // namespace bo_turbo
