// The instances of each bootstrap resample, shared by all algorithms that are compared.
//
// Algorithms run on the same instances, so a resample draws the same instances for all of them and the difficulty of an
// instance cancels in differences (common random numbers). A draw is stored as counts per instance, which is all that
// statistics of sorted values need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relign::statistics {

inline constexpr std::size_t kResamples = 10'000;

class Resampling {
 public:
  // Each resample draws `instances` instances with replacement, uniformly. Resample b is a pure function of (instances,
  // seed, level, b) by Philox (relign/random.hpp), identical on all machines and independent of `resamples`. `level`
  // separates independent draws under one seed. Up to kKeptBytes of counts (one byte per instance and resample) are
  // stored; beyond that they are drawn again on each access. Without instances all resamples are empty. Throws Error
  // (bad_input) for 0 resamples.
  Resampling(std::size_t instances, std::size_t resamples, std::uint64_t seed, std::uint32_t level = 0);
  static constexpr std::size_t kKeptBytes = 60'000'000;

  std::size_t instances() const { return instances_; }
  std::size_t resamples() const { return resamples_; }
  std::uint64_t seed() const { return seed_; }

  // Counts of each instance in a resample; their sum is instances(). Points into the object or into `scratch`, valid
  // until either changes.
  const std::uint8_t* counts(std::size_t resample, std::vector<std::uint8_t>& scratch) const;

 private:
  void draw(std::size_t resample, std::uint8_t* counts) const;

  std::size_t instances_, resamples_;
  std::uint64_t seed_;
  std::uint32_t level_;
  std::vector<std::uint8_t> kept_;  // [resample][instance], or empty
};

}  // namespace relign::statistics
