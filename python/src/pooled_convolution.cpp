#include "pooled_convolution.h"

#include <algorithm>
#include <cstring>

namespace relign::python {
namespace {

constexpr std::size_t kBlock = PooledConvolution::kBlock, kLanes = kBlock / 2, kChunk = 6 * kLanes;
using Shape = PooledConvolution::Shape;
using Lanes = float __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
using Marks = std::int32_t __attribute__((vector_size(4 * kLanes)));

// Compiled for each instruction set and chosen at run time. They round differently: AVX-512 and AVX2 multiply and add
// at once.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define RELIGN_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define RELIGN_CLONES
#endif

const Lanes& lanes(const float* at) { return *reinterpret_cast<const Lanes*>(at); }
Lanes& lanes(float* at) { return *reinterpret_cast<Lanes*>(at); }

constexpr std::size_t kTaps = 9;
constexpr std::size_t kParts = 16;  // of the images; sums are made part by part

std::size_t whole_chunks(std::size_t count) { return (count + kChunk - 1) / kChunk * kChunk; }

// An image with a border of zeros.
struct Padded {
  explicit Padded(const Shape& shape)
      : shape_(shape),
        stride(shape.width + 2),
        plane((shape.height + 2) * stride),
        values(shape.channels * plane, 0.0F) {}
  void load(const float* image) {
    for (std::size_t channel = 0; channel < shape_.channels; ++channel)
      for (std::size_t row = 0; row < shape_.height; ++row)
        std::memcpy(inner(channel, row), image + (channel * shape_.height + row) * shape_.width,
                    shape_.width * sizeof(float));
  }
  void store(float* image) {
    for (std::size_t channel = 0; channel < shape_.channels; ++channel)
      for (std::size_t row = 0; row < shape_.height; ++row)
        std::memcpy(image + (channel * shape_.height + row) * shape_.width, inner(channel, row),
                    shape_.width * sizeof(float));
  }

 private:
  float* inner(std::size_t channel, std::size_t row) { return &values[channel * plane + (row + 1) * stride + 1]; }
  Shape shape_;

 public:
  std::size_t stride, plane;
  std::vector<float> values;
};

// Weights as (out_channels / kBlock, channels * kTaps, kBlock).
std::vector<float> by_lanes(const Shape& shape, const float* weights) {
  const std::size_t taps = shape.channels * kTaps;
  std::vector<float> packed(shape.out_channels * taps);
  for (std::size_t out = 0; out < shape.out_channels; ++out)
    for (std::size_t tap = 0; tap < taps; ++tap)
      packed[(out / kBlock * taps + tap) * kBlock + out % kBlock] = weights[out * taps + tap];
  return packed;
}

// The largest of four values, and which it is.
struct Pooled {
  Lanes value;
  Marks place;
};

inline __attribute__((always_inline)) Pooled pooled(const Lanes& a, const Lanes& b, const Lanes& c, const Lanes& d) {
  Pooled best = {a, {}};
  const auto compare = [&best](const Lanes& other, std::int32_t place) __attribute__((always_inline)) {
    const Marks larger = other > best.value;  // the first of equal ones, as in torch
    best = {larger ? other : best.value, larger ? Marks{} + place : best.place};
  };
  compare(b, 1);
  compare(c, 2);
  compare(d, 3);
  const Marks dark = best.value <= Lanes{};  // not "not above": a NaN stays one
  return {dark ? Lanes{} : best.value, dark ? Marks{} + std::int32_t{PooledConvolution::kNone} : best.place};
}

// The outputs of kBlock channels at one place: `corner` is the first of the 5 x 5 padded pixels below it. The eight
// sums are the registers that AVX2 can keep busy.
RELIGN_CLONES void four_patches(const float* corner, std::size_t stride, std::size_t plane, std::size_t channels,
                                const float* weights, const float* bias, float* largest, std::int32_t* places) {
  Lanes a0 = lanes(bias), b0 = a0, c0 = a0, d0 = a0;
  Lanes a1 = lanes(bias + kLanes), b1 = a1, c1 = a1, d1 = a1;
  for (std::size_t channel = 0; channel < channels; ++channel, corner += plane)
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 3; ++column, weights += kBlock) {
        const Lanes first = lanes(weights), second = lanes(weights + kLanes);
        const float* at = corner + row * stride + column;
        a0 += first * at[0];
        a1 += second * at[0];
        b0 += first * at[2];
        b1 += second * at[2];
        c0 += first * at[2 * stride];
        c1 += second * at[2 * stride];
        d0 += first * at[2 * stride + 2];
        d1 += second * at[2 * stride + 2];
      }
  const Pooled one = pooled(a0, b0, c0, d0), two = pooled(a1, b1, c1, d1);
  lanes(largest) = one.value;
  lanes(largest + kLanes) = two.value;
  std::memcpy(places, &one.place, sizeof one.place);
  std::memcpy(places + kLanes, &two.place, sizeof two.place);
}

// Vectors of `wide` values, each with a factor.
struct Terms {
  explicit Terms(std::size_t most) : at(most + 1), factors(most + 1) {}
  // Without a branch, which would be mispredicted: ReLU gives 0 as often as not.
  void add(std::size_t first, float factor, bool counts) {
    at[count] = first;
    factors[count] = factor;
    count += static_cast<std::size_t>(counts);
  }
  std::vector<std::size_t> at;  // of the first value
  std::vector<float> factors;
  std::size_t count = 0;
};

// Adds count terms to `sum`; `wide` is a multiple of kChunk, the values of six registers.
RELIGN_CLONES void add_terms(float* sum, const float* values, const std::size_t* at, const float* factors,
                             std::size_t count, std::size_t wide) {
  for (std::size_t chunk = 0; chunk < wide; chunk += kChunk) {
    float* to = sum + chunk;
    Lanes a = lanes(to), b = lanes(to + kLanes), c = lanes(to + 2 * kLanes);
    Lanes d = lanes(to + 3 * kLanes), e = lanes(to + 4 * kLanes), f = lanes(to + 5 * kLanes);
    for (std::size_t term = 0; term < count; ++term) {
      const float* from = values + at[term] + chunk;
      const float factor = factors[term];
      a += lanes(from) * factor;
      b += lanes(from + kLanes) * factor;
      c += lanes(from + 2 * kLanes) * factor;
      d += lanes(from + 3 * kLanes) * factor;
      e += lanes(from + 4 * kLanes) * factor;
      f += lanes(from + 5 * kLanes) * factor;
    }
    lanes(to) = a;
    lanes(to + kLanes) = b;
    lanes(to + 2 * kLanes) = c;
    lanes(to + 3 * kLanes) = d;
    lanes(to + 4 * kLanes) = e;
    lanes(to + 5 * kLanes) = f;
  }
}

void add_terms(float* sum, const std::vector<float>& values, const Terms& terms, std::size_t wide) {
  add_terms(sum, values.data(), terms.at.data(), terms.factors.data(), terms.count, wide);
}

// The patches below the two rows of convolved pixels that row `row` of the output pools: (2, 2 * out_width, taps).
void gather(const Shape& shape, const Padded& image, std::size_t row, std::size_t taps, float* patches) {
  for (std::size_t below = 0; below < 2; ++below)
    for (std::size_t column = 0; column < 2 * shape.out_width(); ++column, patches += taps) {
      const float* corner = &image.values[(4 * row + 2 * below) * image.stride + 2 * column];
      float* to = patches;
      for (std::size_t channel = 0; channel < shape.channels; ++channel, corner += image.plane)
        for (std::size_t k = 0; k < 3; ++k, to += 3) std::copy_n(corner + k * image.stride, 3, to);
    }
}

// The patch at this place of an output's four, in the order of gather(); any for kNone.
std::size_t patch_of(std::uint8_t place, std::size_t column, std::size_t columns) {
  return (place % 4 / 2 * columns + column) * 2 + place % 2;
}

// Adds them to an image: the transpose of gather().
void scatter(const Shape& shape, const float* patches, std::size_t row, std::size_t taps, Padded& image) {
  for (std::size_t below = 0; below < 2; ++below)
    for (std::size_t column = 0; column < 2 * shape.out_width(); ++column, patches += taps) {
      float* corner = &image.values[(4 * row + 2 * below) * image.stride + 2 * column];
      const float* from = patches;
      for (std::size_t channel = 0; channel < shape.channels; ++channel, corner += image.plane)
        for (std::size_t k = 0; k < kTaps; ++k, ++from) corner[k / 3 * image.stride + k % 3] += *from;
    }
}

std::size_t first_of(int part, const Shape& shape) { return static_cast<std::size_t>(part) * shape.images / kParts; }

struct Gradients {
  std::vector<float> weights, bias;
};

}  // namespace

void PooledConvolution::forward(const Shape& shape, const float* images, const float* weights, const float* bias,
                                float* out, std::uint8_t* places) {
  const std::lock_guard lock(one_at_a_time_);
  const std::vector<float> packed = by_lanes(shape, weights);
  const std::size_t taps = shape.channels * kTaps, pixels = shape.out_height() * shape.out_width();
  const std::size_t image_size = shape.channels * shape.height * shape.width;
  parallel_.for_each(kParts, [&](int part, unsigned) {
    Padded image(shape);
    for (std::size_t i = first_of(part, shape); i < first_of(part + 1, shape); ++i) {
      image.load(images + i * image_size);
      for (std::size_t block = 0; block < shape.out_channels; block += kBlock)
        for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
          const std::size_t row = pixel / shape.out_width(), column = pixel % shape.out_width();
          float largest[kBlock];
          std::int32_t which[kBlock];
          four_patches(&image.values[4 * row * image.stride + 4 * column], image.stride, image.plane, shape.channels,
                       &packed[block * taps], bias + block, largest, which);
          const std::size_t to = (i * shape.out_channels + block) * pixels + pixel;
          for (std::size_t lane = 0; lane < kBlock; ++lane) {
            out[to + lane * pixels] = largest[lane];
            places[to + lane * pixels] = static_cast<std::uint8_t>(which[lane]);
          }
        }
    }
  });
}

void PooledConvolution::backward(const Shape& shape, const float* images, const float* weights, const float* gradient,
                                 const std::uint8_t* places, float* of_images, float* of_weights, float* of_bias) {
  const std::lock_guard lock(one_at_a_time_);
  const std::size_t taps = shape.channels * kTaps, wide = whole_chunks(taps);
  const std::size_t columns = shape.out_width(), pixels = shape.out_height() * columns;
  const std::size_t image_size = shape.channels * shape.height * shape.width;
  std::vector<float> filters(shape.out_channels * wide, 0.0F);
  for (std::size_t out = 0; out < shape.out_channels; ++out)
    std::copy_n(weights + out * taps, taps, &filters[out * wide]);
  std::vector<Gradients> sums(kParts);
  parallel_.for_each(kParts, [&](int part, unsigned) {
    Gradients& sum = sums[static_cast<std::size_t>(part)];
    sum.weights.assign(shape.out_channels * wide, 0.0F);
    sum.bias.assign(shape.out_channels, 0.0F);
    Padded image(shape), of_image(shape);
    std::vector<float> patches(2 * 2 * columns * wide, 0.0F), of_patches(patches.size());
    Terms of_filter(columns);
    std::vector<Terms> of_patch(of_images ? 2 * 2 * columns : 0, Terms(shape.out_channels));
    for (std::size_t i = first_of(part, shape); i < first_of(part + 1, shape); ++i) {
      image.load(images + i * image_size);
      if (of_images) std::fill(of_image.values.begin(), of_image.values.end(), 0.0F);
      for (std::size_t row = 0; row < shape.out_height(); ++row) {
        gather(shape, image, row, wide, patches.data());
        for (Terms& terms : of_patch) terms.count = 0;
        for (std::size_t out = 0; out < shape.out_channels; ++out) {
          const std::size_t at = (i * shape.out_channels + out) * pixels + row * columns;
          of_filter.count = 0;
          for (std::size_t column = 0; column < columns; ++column)
            of_filter.add(patch_of(places[at + column], column, columns) * wide, gradient[at + column],
                          places[at + column] != kNone);
          for (std::size_t term = 0; term < of_filter.count; ++term) sum.bias[out] += of_filter.factors[term];
          add_terms(&sum.weights[out * wide], patches, of_filter, wide);
          for (std::size_t column = 0; of_images && column < columns; ++column)
            of_patch[patch_of(places[at + column], column, columns)].add(out * wide, gradient[at + column],
                                                                         places[at + column] != kNone);
        }
        if (!of_images) continue;
        std::fill(of_patches.begin(), of_patches.end(), 0.0F);
        for (std::size_t patch = 0; patch < of_patch.size(); ++patch)
          add_terms(&of_patches[patch * wide], filters, of_patch[patch], wide);
        scatter(shape, of_patches.data(), row, wide, of_image);
      }
      if (of_images) of_image.store(of_images + i * image_size);
    }
  });
  std::fill_n(of_weights, shape.out_channels * taps, 0.0F);
  std::fill_n(of_bias, shape.out_channels, 0.0F);
  for (const Gradients& sum : sums)
    for (std::size_t out = 0; out < shape.out_channels; ++out) {
      of_bias[out] += sum.bias[out];
      for (std::size_t tap = 0; tap < taps; ++tap) of_weights[out * taps + tap] += sum.weights[out * wide + tap];
    }
}

}  // namespace relign::python
