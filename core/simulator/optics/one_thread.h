// A Block is the threads that share a piece of work, so that the same code runs on a GPU and in a plain loop:
// `for_each(count, body)` calls body(i) for all i, each by one thread, and ends when all have; `sum(count, sums,
// terms)` adds two terms for each i in the order of i, for every thread. NVRTC compiles this header.
#pragma once

#include <relign/philox.hpp>

namespace relign::optics {

struct OneThread {
  template <class Body>
  RELIGN_DEVICE void for_each(std::int32_t count, const Body& body) const {
    for (std::int32_t i = 0; i < count; ++i) body(i);
  }
  template <class Terms>
  RELIGN_DEVICE void sum(std::int32_t count, double (&sums)[2], const Terms& terms) const {
    for (std::int32_t i = 0; i < count; ++i) {
      double first = 0, second = 0;
      terms(i, first, second);
      sums[0] += first;
      sums[1] += second;
    }
  }
};

}  // namespace relign::optics
