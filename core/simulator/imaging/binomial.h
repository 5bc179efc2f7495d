// The distribution of the number of rays of a pixel, for CPU and GPU. NVRTC compiles this header.
#pragma once

#include <cmath>
#include <cstdint>

namespace relign::imaging {

// A positive number with a separate exponent: the first terms of a long distribution are below the range of double.
// Bit-equal to double within that range.
class Wide {
 public:
  explicit Wide(double value) : share_(value) { settle(); }
  Wide& operator*=(double factor) {
    share_ *= factor;
    settle();
    return *this;
  }
  Wide& operator*=(const Wide& factor) {
    exponent_ += factor.exponent_;
    return *this *= factor.share_;
  }
  double value() const { return std::ldexp(share_, exponent_); }

 private:
  void settle() {
    int power = 0;
    share_ = std::frexp(share_, &power);
    exponent_ += power;
  }
  double share_;
  int exponent_ = 0;
};

// Distribution function of Binomial(n, p), p < 1, in units of 2^-32: a uniform word that reaches k of the thresholds
// draws k. Returns the number of thresholds; `thresholds` has space for n.
inline int binomial_thresholds(int n, double p, std::uint32_t* thresholds) {
  // By the recurrence of its terms.
  Wide term(1);  // (1 - p)^n by squaring
  Wide base(1 - p);
  for (int left = n; left > 0; left >>= 1) {
    if (left & 1) term *= base;
    base *= Wide(base);
  }
  double sum = 0;
  int levels = 0;
  for (int k = 0; k < n; ++k) {
    sum += term.value();
    const double scaled = sum * 4294967296.0;
    if (scaled >= 4294967295.0) break;
    thresholds[levels++] = static_cast<std::uint32_t>(scaled);
    term *= (n - k) * p / ((k + 1) * (1 - p));
  }
  return levels;
}

}  // namespace relign::imaging
