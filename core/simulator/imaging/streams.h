// What captures draw at random, for CPU and GPU kernels: the streams of a frame's seed and the samplers' constants. No
// library functions: NVRTC compiles this header.
#pragma once

#include <cstdint>

namespace relign::imaging {

// Random streams of one frame seed, from RayPath::streams on: one for each purpose.
enum CaptureStream : std::uint32_t { kCounts = 0, kDirections = 1, kLattice = 2 };
// Of transport `ghost`: the number of a pixel's paths, their starts; what happens to blocks of rays on a CPU, to a path
// on a GPU, and where the sensor scatters it there. Noise-free images use those from 64 on.
enum GhostStream : std::uint32_t {
  kGhostCounts = 32,
  kGhostStarts = 33,
  kGhostBlocks = 34,
  kGhostWalks = 35,
  kGhostScatter = 36
};

// Russian roulette of the paper's renderer: survival 0.95 at each of the last four faces. One random number decides for
// all: a ray survives with the product of the probabilities.
constexpr double kRouletteSurvival = 0.95 * 0.95 * 0.95 * 0.95;

// Kronecker sequence of the generalised golden ratio in four dimensions, as 32-bit fractions: powers of
// 1 / 1.16730397826141868..., the root of x^5 = x + 1.
inline constexpr std::uint32_t kLatticeSteps[4] = {3679390609U, 3152041523U, 2700274805U, 2313257605U};

}  // namespace relign::imaging
