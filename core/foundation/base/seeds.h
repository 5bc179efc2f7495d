// Derives every seed. Each source of randomness has its own seed, a pure function of what it belongs
// to and never of the order of calls, so that methods are compared under common random numbers.
#pragma once

#include <cstdint>
#include <string_view>

namespace relign {

// Training, tuning (choice of checkpoints), pretraining (source instances) and benchmark instances never share a seed.
enum class SeedDomain : std::uint32_t { benchmark = 0, training = 1, tuning = 2, pretraining = 3 };

// Seed of the perturbations of instance `number`. It is the same at every noise level, so that levels
// differ by their distribution only.
std::uint64_t instance_seed(std::uint64_t suite_seed, SeedDomain domain, std::uint64_t number);

// Seed of what the instances of batch `number` share. Not the seed of any instance.
std::uint64_t batch_seed(std::uint64_t suite_seed, SeedDomain domain, std::uint64_t number);

enum class FrameStream : std::uint32_t {
  capture = 0,            // what the algorithm observes
  truth_commanded = 1,    // noise-free MSE at the true pose
  truth_recommended = 2,  // noise-free MSE at the recommended pose
  own_optimum = 3,
  stage_errors = 4,  // repeatability of the move before the frame
  inspection = 5     // errors of measuring the cure shift; of frame 0
};

// The seed of one frame of one instance.
std::uint64_t frame_seed(std::uint64_t instance_seed, std::uint32_t step, FrameStream stream);

// The algorithm's own seed on one instance. `label` distinguishes entries of a suite.
std::uint64_t algorithm_seed(std::uint64_t suite_seed, std::string_view label, std::uint64_t number);

}  // namespace relign
