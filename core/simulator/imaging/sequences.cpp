#include "imaging/sequences.h"

#include <cmath>
#include <cstddef>

namespace relign::imaging {

namespace {

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

}  // namespace

int binomial_thresholds(int n, double p, std::uint32_t* thresholds) {
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

std::vector<int> allocate_samples(int total, const std::vector<double>& weights) {
  // One sample at a time to the largest deficit: no count exceeds its share rounded up.
  std::vector<int> counts(weights.size(), 1);
  for (int given = static_cast<int>(weights.size()); given < total; ++given) {
    std::size_t next = 0;
    double largest = -1e300;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double deficit = total * weights[i] - counts[i];
      if (deficit <= largest) continue;
      largest = deficit;
      next = i;
    }
    ++counts[next];
  }
  return counts;
}

}  // namespace relign::imaging
