#include "pooled_convolution.h"

#include <algorithm>
#include <cstring>
#include <optional>

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
constexpr std::uint8_t kNone = PooledConvolution::kNone;
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

// The gradients of one part of the images, summed in their order.
class PartGradients {
 public:
  // `filters`: the weights, (out_channels, whole_chunks(taps)), which must outlive this.
  PartGradients(const Shape& shape, const std::vector<float>& filters, bool wants_images)
      : weights(filters.size(), 0.0F),
        bias(shape.out_channels, 0.0F),
        shape_(shape),
        wide_(whole_chunks(shape.channels * kTaps)),
        patch_count_(2 * 2 * shape.out_width()),
        filters_(&filters),
        image_(shape),
        of_image_(shape),
        patches_(patch_count_ * wide_, 0.0F),
        of_patches_(patches_.size()),
        of_filter_(shape.out_width()),
        of_patch_(wants_images ? patch_count_ : 0, Terms(shape.out_channels)) {}

  // One image, with the gradients and places of its outputs. Writes the image's own gradient unless of_image is null.
  void add(const float* image, const float* gradient, const std::uint8_t* places, float* of_image) {
    image_.load(image);
    std::fill(of_image_.values.begin(), of_image_.values.end(), 0.0F);
    for (std::size_t row = 0; row < shape_.out_height(); ++row) {
      gather(shape_, image_, row, wide_, patches_.data());
      add_row(gradient + row * shape_.out_width(), places + row * shape_.out_width());
      if (of_image) add_row_to_image(row);
    }
    if (of_image) of_image_.store(of_image);
  }

  std::vector<float> weights, bias;  // weights as filters

 private:
  void add_row(const float* gradient, const std::uint8_t* places) {
    const std::size_t columns = shape_.out_width(), pixels = shape_.out_height() * columns;
    for (Terms& terms : of_patch_) terms.count = 0;
    for (std::size_t out = 0; out < shape_.out_channels; ++out, gradient += pixels, places += pixels) {
      of_filter_.count = 0;
      for (std::size_t column = 0; column < columns; ++column)
        of_filter_.add(patch_of(places[column], column, columns) * wide_, gradient[column], places[column] != kNone);
      for (std::size_t term = 0; term < of_filter_.count; ++term) bias[out] += of_filter_.factors[term];
      add_terms(&weights[out * wide_], patches_, of_filter_, wide_);
      if (of_patch_.empty()) continue;
      for (std::size_t column = 0; column < columns; ++column)
        of_patch_[patch_of(places[column], column, columns)].add(out * wide_, gradient[column],
                                                                 places[column] != kNone);
    }
  }

  void add_row_to_image(std::size_t row) {
    std::fill(of_patches_.begin(), of_patches_.end(), 0.0F);
    for (std::size_t patch = 0; patch < of_patch_.size(); ++patch)
      add_terms(&of_patches_[patch * wide_], *filters_, of_patch_[patch], wide_);
    scatter(shape_, of_patches_.data(), row, wide_, of_image_);
  }

  Shape shape_;
  std::size_t wide_, patch_count_;
  const std::vector<float>* filters_;
  Padded image_, of_image_;
  std::vector<float> patches_, of_patches_;
  Terms of_filter_;
  std::vector<Terms> of_patch_;
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
  const std::size_t outputs = shape.out_channels * shape.out_height() * shape.out_width();
  const std::size_t image_size = shape.channels * shape.height * shape.width;
  std::vector<float> filters(shape.out_channels * wide, 0.0F);
  for (std::size_t out = 0; out < shape.out_channels; ++out)
    std::copy_n(weights + out * taps, taps, &filters[out * wide]);
  std::vector<std::optional<PartGradients>> parts(kParts);
  parallel_.for_each(kParts, [&](int part, unsigned) {
    PartGradients& sums = parts[static_cast<std::size_t>(part)].emplace(shape, filters, of_images != nullptr);
    for (std::size_t i = first_of(part, shape); i < first_of(part + 1, shape); ++i)
      sums.add(images + i * image_size, gradient + i * outputs, places + i * outputs,
               of_images ? of_images + i * image_size : nullptr);
  });
  std::fill_n(of_weights, shape.out_channels * taps, 0.0F);
  std::fill_n(of_bias, shape.out_channels, 0.0F);
  for (const std::optional<PartGradients>& sums : parts)
    for (std::size_t out = 0; out < shape.out_channels; ++out) {
      of_bias[out] += sums->bias[out];
      for (std::size_t tap = 0; tap < taps; ++tap) of_weights[out * taps + tap] += sums->weights[out * wide + tap];
    }
}

}  // namespace relign::python
