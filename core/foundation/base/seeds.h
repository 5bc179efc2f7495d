// Where every seed comes from. One seed per axis of randomness, each a pure function of what it
// belongs to, never of the order of calls (rule of common random numbers).
#pragma once

#include <cstdint>
#include <string_view>

namespace relign {

// Training, tuning (choice of checkpoints), preparation (source instances) and benchmark instances never share a seed.
enum class SeedDomain : std::uint32_t { benchmark = 0, training = 1, tuning = 2, preparation = 3 };

// The draw of W of instance `number`. The same number has the same seed at every noise level, so
// that levels differ by their distribution only.
std::uint64_t instance_seed(std::uint64_t suite_seed, SeedDomain domain, std::uint64_t number);

enum class FrameStream : std::uint32_t {
  capture = 0,            // what the algorithm sees
  truth_commanded = 1,    // noise-free MSE at the true pose
  truth_recommended = 2,  // noise-free MSE at the recommended pose
  own_optimum = 3
};

// The seed of one frame of one instance.
std::uint64_t frame_seed(std::uint64_t instance_seed, std::uint32_t step, FrameStream stream);

// The algorithm's own seed on one instance. `label` tells apart entries of a suite.
std::uint64_t algorithm_seed(std::uint64_t suite_seed, std::string_view label, std::uint64_t number);

}  // namespace relign
