// Which instances each bootstrap resample draws: once for all algorithms that are compared.
//
// Algorithms met the same instances, so a resample must draw the same instances for all of them: then what an easy or
// a hard instance does to all cancels in their differences (common random numbers). The draws are counts, how often
// each instance was drawn, because that is all that statistics of sorted values need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relign::statistics {

inline constexpr std::size_t kResamples = 10'000;

class Resampling {
 public:
  // `resamples` draws of `instances` out of `instances`, with replacement, each instance equally likely. Resample b is
  // a pure function of (instances, seed, level, b) by Philox (relign/random.hpp), the same on every machine, and does
  // not depend on `resamples`. `level` tells apart draws that must be independent of each other under one seed.
  // Up to kKeptBytes of counts (one byte an instance and resample) are kept; larger ones are drawn again whenever they
  // are asked for. No instances: every resample is empty. Throws Error (bad_input) without any resample.
  Resampling(std::size_t instances, std::size_t resamples, std::uint64_t seed, std::uint32_t level = 0);
  static constexpr std::size_t kKeptBytes = 60'000'000;

  std::size_t instances() const { return instances_; }
  std::size_t resamples() const { return resamples_; }
  std::uint64_t seed() const { return seed_; }

  // How often each instance is in a resample; they add up to instances(). Points into the object or into `scratch`,
  // valid until either changes.
  const std::uint8_t* counts(std::size_t resample, std::vector<std::uint8_t>& scratch) const;

 private:
  void draw(std::size_t resample, std::uint8_t* counts) const;

  std::size_t instances_, resamples_;
  std::uint64_t seed_;
  std::uint32_t level_;
  std::vector<std::uint8_t> kept_;  // [resample][instance], or empty
};

}  // namespace relign::statistics
