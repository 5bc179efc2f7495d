// What electronics and imaging errors do to one pixel, written once: loops over pixels apply it on the CPU
// (pixel_loops.cpp, stray_light.cpp, read_out.cpp), GPU kernels to the pixels of a thread (gpu/read_out_steps.h).
//
// Compiled by NVRTC, too: no library functions, everything inlined. Each operation rounds as IEEE 754 says, so that all
// give the same bits.
#pragma once

#include "imaging/error_math.h"
#include "optics/ray_steps.h"

namespace relign::imaging {

// Random streams: of the seed of the errors of a capture or of a station's patterns; and of the frame's own seed.
enum PixelStream : std::uint32_t { kPatterns = 0, kPhotons = 1, kReadNoise = 2, kElectronics = 16 };

// Four random words of a pixel.
struct PixelWords {
  std::uint32_t of[4];
};

RELIGN_DEVICE PixelWords pixel_words(std::uint32_t stream, std::uint64_t seed, std::uint32_t pixel) {
  PixelWords words = {{0, pixel, stream, 0}};
  philox_rounds(words.of, static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32));
  return words;
}

RELIGN_DEVICE std::uint32_t sum_of_bytes(std::uint32_t word) {
  const std::uint32_t pairs = (word & 0x00ff00ffU) + (word >> 8 & 0x00ff00ffU);
  return (pairs & 0xffffU) + (pairs >> 16);
}

RELIGN_DEVICE std::uint32_t sum_of_bytes(const PixelWords& words) {
  return sum_of_bytes(words.of[0]) + sum_of_bytes(words.of[1]) + sum_of_bytes(words.of[2]) + sum_of_bytes(words.of[3]);
}

// Nearly normal, of mean 0 and variance 1: a sum of uniform bytes, scaled. Its tails end at sqrt(3 Bytes).
template <int Bytes>
RELIGN_DEVICE float normal_of(std::uint32_t sum) {
  static_assert(Bytes == 8 || Bytes == 12 || Bytes == 16);
  // Half of the inverse standard deviation, 0.5 / sqrt(65535 Bytes / 12).
  constexpr float unit = Bytes == 8 ? 0.00239209807F : Bytes == 12 ? 0.0019531399F : 0.00169146876F;
  return (static_cast<float>(static_cast<std::int32_t>(2 * sum)) - static_cast<float>(255 * Bytes)) * unit;
}

// A scene's electronics (read_out.h).
struct ReadOut {
  double electrons_per_unit, read_variance, full_well, saturation;
  double steps;                  // 0: grey values are not rounded
  std::int32_t adds_shot_noise;  // 0: the rays are drawn like photons
  std::int32_t present;          // 0: no electronics
};

RELIGN_DEVICE float read_out_pixel(const ReadOut& electronics, float value, std::uint32_t bytes) {
  constexpr double kMeanOfBytes = 16 * 127.5, kVarianceOfBytes = 16 * (256.0 * 256.0 - 1) / 12;
  const double unit = 1 / optics::square_root(kVarianceOfBytes);
  double electrons = static_cast<double>(value) * electronics.electrons_per_unit;
  const double variance = electronics.read_variance + (electronics.adds_shot_noise ? electrons : 0);
  electrons += (static_cast<double>(bytes) - kMeanOfBytes) * unit * optics::square_root(variance);
  double filled = electrons / electronics.full_well;
  filled = filled < 0 ? 0.0 : filled;
  filled = filled > 1 ? 1.0 : filled;
  if (electronics.steps > 0) filled = round_down(filled * electronics.steps + 0.5) / electronics.steps;
  return static_cast<float>(filled * electronics.saturation);
}

// Light is reduced by `loss` at the distance of a corner from the image's middle, as a quadratic of the distance from a
// centre beside it.
struct Vignetting {
  float loss;               // per square pixel; 0: none
  float left, top, centre;  // x of the first column from the centre; y of the first row from the middle, and its centre
};

RELIGN_DEVICE float vignetting_y(const Vignetting& vignetting, std::int32_t row) {
  return static_cast<float>(row) + vignetting.top - vignetting.centre;
}

RELIGN_DEVICE float kept_light(float loss, float x, float y) {
  const float kept = 1 - loss * (x * x + y * y);
  return kept < 0 ? 0.0F : kept;
}

// Smooth stray light is computed at the nodes of a coarse grid over the image; between them it is bilinear.
constexpr std::int32_t kStrayCells = 32, kStrayNodes = kStrayCells + 1;

struct GridPlace {
  std::int32_t cell;
  float share;  // of the next node
};

// Of a row or column of `count`.
RELIGN_DEVICE GridPlace place_in_grid(std::int32_t index, std::int32_t count) {
  const double at = (static_cast<double>(index) + 0.5) * kStrayCells / static_cast<double>(count);
  const auto cell = static_cast<std::int32_t>(at);
  return {cell, static_cast<float>(at - static_cast<double>(cell))};
}

RELIGN_DEVICE float between(float one, float next, float share) { return one + share * (next - one); }

RELIGN_DEVICE float smooth_light(const float* nodes, const GridPlace& column, const GridPlace& row) {
  const float* const above = nodes + row.cell * kStrayNodes + column.cell;
  const float* const below = above + kStrayNodes;
  return between(between(above[0], above[1], column.share), between(below[0], below[1], column.share), row.share);
}

// A thin ring or arc: brightness (1 - (d / half width)^2)^2 at distance d from a circle of radius R, with d taken as
// (r^2 - R^2) / 2R. An arc fades out around both ends. Lengths in units of the image's longer side.
struct Ring {
  double pitch, y;   // of pixels; of the centre
  double reach;      // rows farther from the centre get no light
  float left, step;  // x of the first pixel from the centre, and from pixel to pixel
  float radius2, per_width;
  float start, fade, along_x, along_y;
  float bright;
};

RELIGN_DEVICE double ring_y(const Ring& ring, std::int32_t row) {
  return (static_cast<double>(row) + 0.5) * ring.pitch - ring.y;
}

RELIGN_DEVICE float ring_light(const Ring& ring, float y, std::int32_t column) {
  const float x = ring.left + ring.step * static_cast<float>(column);
  const float d = (x * x + y * y - ring.radius2) * ring.per_width;
  float profile = 1 - d * d;
  profile = profile < 0 ? 0.0F : profile;
  float within = ring.start + ring.fade * (x * ring.along_x + y * ring.along_y);
  within = within < 0 ? 0.0F : within;
  within = within > 1 ? 1.0F : within;
  return ring.bright * within * (profile * profile);
}

// What a station's stray light is scaled to.
struct StrayLevels {
  double mean;        // over the image, in units of white
  double ring_share;  // of rings and arcs
};
struct StrayFactors {
  float smooth, rings;
};

// From the sums of both kinds over the image. Where no ring crosses it, all stray light is smooth.
RELIGN_DEVICE StrayFactors stray_factors(const StrayLevels& levels, double smooth_sum, double ring_sum, double pixels) {
  const double smooth = smooth_sum / pixels, thin = ring_sum / pixels;
  const double of_rings = thin > 0 ? levels.ring_share : 0;
  return {static_cast<float>(levels.mean * (1 - of_rings) / smooth),
          static_cast<float>(thin > 0 ? levels.mean * of_rings / thin : 0)};
}

RELIGN_DEVICE float stray_light(const StrayFactors& factors, float smooth, float rings) {
  return factors.smooth * smooth + factors.rings * rings;
}

// A value v becomes quantum * k, k Poisson-distributed with mean v / quantum; negative values stay. Up to kFewPhotons
// by inversion of the distribution, cut at a probability of 1e-6; above, from a normal z with mean, variance and,
// nearly, skewness of Poisson: m + sqrt(m - 5/36) z + (z^2 - 1) / 6, rounded.
constexpr float kFewPhotons = 12;
constexpr int kMostCounts = 48;  // of them

RELIGN_DEVICE float photon_mean(float value, float per_quantum) {
  const float mean = value * per_quantum;
  return mean < 0 ? 0.0F : mean;
}

// A count, and all below it.
struct PoissonSum {
  float probability, below;
};

RELIGN_DEVICE PoissonSum no_photons(float mean) {
  constexpr float kLog2E = 1.44269504F;
  const float probability = exp2_of(-kLog2E * (mean > kFewPhotons ? 0.0F : mean));
  return {probability, probability};
}

RELIGN_DEVICE float poisson_word(std::uint32_t word) {
  return static_cast<float>(static_cast<std::int32_t>(word >> 8)) * (0x1p-24F * 0.999999F);
}

// per_count: 1 / k.
RELIGN_DEVICE void add_count(PoissonSum& sum, float mean, float per_count) {
  constexpr float kNegligible = 1e-20F;
  const float next = sum.probability * (mean * per_count);
  sum.probability = next < kNegligible ? 0.0F : next;  // before it becomes denormal, which is slow
  sum.below += sum.probability;
}

// How many steps a loop over pixels does, for the largest mean of few photons: all words have their counts by then.
RELIGN_DEVICE int photon_steps(float mean) {
  const int steps = static_cast<int>(mean + 5.5F * optics::square_root(mean) + 6);
  return steps < kMostCounts ? steps : kMostCounts;
}

// The count of one pixel.
RELIGN_DEVICE float few_photons(float mean, std::uint32_t random) {
  const float word = poisson_word(random);
  PoissonSum sum = no_photons(mean);
  float count = 0;
  for (int k = 1; k <= kMostCounts && word >= sum.below; ++k) {
    count += 1.0F;
    add_count(sum, mean, 1 / static_cast<float>(k));
  }
  return count;
}

RELIGN_DEVICE float many_photons(float mean, std::uint32_t bytes) {
  const float z = normal_of<12>(bytes);
  const float root = optics::square_root(mean > kFewPhotons ? mean - 5.0F / 36 : 0.0F);
  const float drawn = mean + root * z + (z * z - 1) * (1.0F / 6) + 0.5F;
  constexpr float kWhole = 0x1p30F;  // floats of this size are integers
  const float limited = drawn > kWhole ? kWhole : drawn;
  const auto whole = static_cast<float>(static_cast<std::int32_t>(limited < 0 ? 0.0F : limited));
  return drawn > kWhole ? drawn : whole;
}

RELIGN_DEVICE std::uint32_t photon_bytes(std::uint32_t u1, std::uint32_t u2, std::uint32_t u3) {
  return sum_of_bytes(u1) + sum_of_bytes(u2) + sum_of_bytes(u3);
}

RELIGN_DEVICE float light_of_photons(float value, float quantum, float count) {
  return value > 0 ? quantum * count : value;
}

RELIGN_DEVICE float curved(float value, float gamma, float white, float per_white) {
  constexpr float kLeast = 1e-30F;
  const float share = value * per_white;
  const float power = white * exp2_of(gamma * log2_of(share > kLeast ? share : kLeast));
  return share > kLeast ? power : value;
}

RELIGN_DEVICE float limited(float value, float full_scale) {
  const float filled = value < 0 ? 0.0F : value;
  return filled > full_scale ? full_scale : filled;
}

RELIGN_DEVICE float rounded(float value, float per_step, float step) {
  return step * static_cast<float>(static_cast<std::int32_t>(value * per_step + 0.5F));
}

// The errors of one capture, but for its target, blur, stray light and hot pixels.
struct ErrorLevels {
  std::uint64_t frame_seed, pattern_seed;  // of noise; of the station's patterns
  Vignetting vignetting;
  float white;
  float photon, pixel_gain, gain, gamma, pixel_offset, offset, read_noise;
  float full_scale;  // 0: not limited
  float steps;       // 0: not rounded
};

// Both compilers must see the same layout.
static_assert(sizeof(ReadOut) == 48 && sizeof(Ring) == 64 && sizeof(ErrorLevels) == 72);

}  // namespace relign::imaging
