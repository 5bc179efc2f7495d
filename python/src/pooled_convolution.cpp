#include "pooled_convolution.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

namespace relign::python {
namespace {

constexpr std::size_t kBlock = PooledConvolution::kBlock, kLanes = kBlock / 2;
constexpr std::uint8_t kNone = PooledConvolution::kNone;
constexpr std::size_t kRows = 3;    // of a patch, which has as many columns
constexpr std::size_t kParts = 16;  // of the images; sums are made part by part
using Shape = PooledConvolution::Shape;
using Images = PooledConvolution::Images;
using Lanes = float __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
using Marks = std::int32_t __attribute__((vector_size(4 * kLanes)));
using Bytes = std::uint8_t __attribute__((vector_size(kLanes), aligned(1), may_alias));

// Compiled for each instruction set and chosen at run time. They round differently: AVX-512 and AVX2 multiply and add
// at once.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define RELIGN_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define RELIGN_CLONES
#endif
#define RELIGN_INLINE inline __attribute__((always_inline))  // into each clone

const Lanes& lanes(const float* at) { return *reinterpret_cast<const Lanes*>(at); }
Lanes& lanes(float* at) { return *reinterpret_cast<Lanes*>(at); }

// The numbers in a row of a patch, and in one of filters and sums, which end with zeros.
std::size_t row_of(const Shape& shape) { return kRows * shape.channels; }
std::size_t wide_row_of(const Shape& shape) { return (row_of(shape) + kBlock - 1) / kBlock * kBlock; }

// An image with a border of zeros, and behind it what wide rows reach.
struct Padded {
  explicit Padded(const Shape& shape)
      : channels(shape.channels),
        stride((shape.width + 2) * shape.channels),
        values((shape.height + 2) * stride + kBlock, 0.0F),
        height_(shape.height),
        width_(shape.width) {}

  void load(const Images& images, std::size_t number) {
    const float* from = images.first + number * images.image;
    for (std::size_t row = 0; row < height_; ++row, from += images.row) {
      if (images.channel == 1 && images.column == channels) {
        std::memcpy(inner(row), from, width_ * channels * sizeof(float));
        continue;
      }
      for (std::size_t channel = 0; channel < channels; ++channel) {
        const float* at = from + channel * images.channel;
        float* to = inner(row) + channel;
        for (std::size_t column = 0; column < width_; ++column, at += images.column, to += channels) *to = *at;
      }
    }
  }
  void store(float* image) {
    for (std::size_t row = 0; row < height_; ++row)
      std::memcpy(image + row * width_ * channels, inner(row), width_ * channels * sizeof(float));
  }
  // The first number of the patches that an output pools. Those at place p begin at to(p) behind it.
  std::size_t corner(std::size_t row, std::size_t column) const { return 4 * (row * stride + column * channels); }
  std::size_t to(std::size_t place) const { return 2 * (place / 2 * stride + place % 2 * channels); }

  std::size_t channels, stride;
  std::vector<float> values;

 private:
  float* inner(std::size_t row) { return &values[(row + 1) * stride + channels]; }
  std::size_t height_, width_;
};

// Calls body(place of the weight, output, row of the patch, place in the row) for all weights.
template <class Body>
void for_weights(const Shape& shape, const Body& body) {
  std::size_t at = 0;
  for (std::size_t out = 0; out < shape.out_channels; ++out)
    for (std::size_t channel = 0; channel < shape.channels; ++channel)
      for (std::size_t row = 0; row < kRows; ++row)
        for (std::size_t column = 0; column < kRows; ++column, ++at)
          body(at, out, row, column * shape.channels + channel);
}

// The largest of four values, and which it is.
struct Pooled {
  Lanes value;
  Bytes place;
};

RELIGN_INLINE Pooled pooled(const Lanes& a, const Lanes& b, const Lanes& c, const Lanes& d) {
  Lanes best = a;
  Marks which = {};
  const auto compare = [&](const Lanes& other, std::int32_t place) __attribute__((always_inline)) {
    // As in torch, the first of equal ones, and NaN is larger than all numbers.
    const Marks larger = (other > best) | (other != other);
    best = larger ? other : best;
    which = larger ? Marks{} + place : which;
  };
  compare(b, 1);
  compare(c, 2);
  compare(d, 3);
  const Marks dark = best <= Lanes{};  // not "not above": a NaN stays one
  which = dark ? Marks{} + std::int32_t{kNone} : which;
  return {dark ? Lanes{} : best, __builtin_convertvector(which, Bytes)};
}

// kBlock channels of an output, whose patches begin at `corner`. `weights`: (kRows, row, kBlock). The eight sums are
// the registers that AVX2 can keep busy.
RELIGN_CLONES void pool_patches(const float* corner, std::size_t stride, std::size_t channels, const float* weights,
                                const float* bias, float* out, std::uint8_t* places) {
  Lanes a0 = lanes(bias), b0 = a0, c0 = a0, d0 = a0;
  Lanes a1 = lanes(bias + kLanes), b1 = a1, c1 = a1, d1 = a1;
  for (std::size_t row = 0; row < kRows; ++row) {
    const float *a = corner + row * stride, *b = a + 2 * channels, *c = a + 2 * stride, *d = b + 2 * stride;
    for (std::size_t k = 0; k < kRows * channels; ++k, weights += kBlock) {
      const Lanes first = lanes(weights), second = lanes(weights + kLanes);
      a0 += first * a[k];
      a1 += second * a[k];
      b0 += first * b[k];
      b1 += second * b[k];
      c0 += first * c[k];
      c1 += second * c[k];
      d0 += first * d[k];
      d1 += second * d[k];
    }
  }
  const Pooled one = pooled(a0, b0, c0, d0), two = pooled(a1, b1, c1, d1);
  lanes(out) = one.value;
  lanes(out + kLanes) = two.value;
  *reinterpret_cast<Bytes*>(places) = one.place;
  *reinterpret_cast<Bytes*>(places + kLanes) = two.place;
}

// A patch, by its first number, and its factor.
struct Term {
  std::size_t at;
  float factor;
};

// Patches whose rows are `stride` apart.
template <class Number>
struct Patches {
  Number* first;
  std::size_t stride;
};

template <std::size_t vectors>
RELIGN_INLINE void add_columns(Patches<float> sum, Patches<const float> patches, const Term* term, const Term* end) {
  Lanes sums[kRows][vectors];
#pragma GCC unroll 3
  for (std::size_t row = 0; row < kRows; ++row)
#pragma GCC unroll 4
    for (std::size_t k = 0; k < vectors; ++k) sums[row][k] = lanes(sum.first + row * sum.stride + k * kLanes);
  for (; term != end; ++term) {
    const float* from = patches.first + term->at;
    const float factor = term->factor;
#pragma GCC unroll 3
    for (std::size_t row = 0; row < kRows; ++row)
#pragma GCC unroll 4
      for (std::size_t k = 0; k < vectors; ++k)
        sums[row][k] += lanes(from + row * patches.stride + k * kLanes) * factor;
  }
#pragma GCC unroll 3
  for (std::size_t row = 0; row < kRows; ++row)
#pragma GCC unroll 4
    for (std::size_t k = 0; k < vectors; ++k) lanes(sum.first + row * sum.stride + k * kLanes) = sums[row][k];
}

// Adds patches to the one at `sum`; `wide`, the length of their rows, is a multiple of kBlock.
RELIGN_CLONES void add_patches(Patches<float> sum, Patches<const float> patches, const Term* terms, const Term* end,
                               std::size_t wide) {
  std::size_t done = 0;
  for (; done + 2 * kBlock <= wide; done += 2 * kBlock, sum.first += 2 * kBlock, patches.first += 2 * kBlock)
    add_columns<4>(sum, patches, terms, end);
  if (done < wide) add_columns<2>(sum, patches, terms, end);
}

std::size_t first_of(int part, const Shape& shape) { return static_cast<std::size_t>(part) * shape.images / kParts; }

// The gradients of one part of the images, summed in their order.
class PartGradients {
 public:
  // `filters`: the weights, (out_channels, kRows, wide row), which must outlive this.
  PartGradients(const Shape& shape, const std::vector<float>& filters)
      : weights(filters.size(), 0.0F),
        bias(shape.out_channels, 0.0F),
        shape_(shape),
        wide_(wide_row_of(shape)),
        filters_(filters),
        image_(shape),
        of_image_(shape),
        terms_((kNone + 1) * longest_list()) {}

  // One image, with the gradients and places of its outputs. Writes the image's own gradient unless of_image is null.
  void add(const Images& images, std::size_t number, const float* gradient, const std::uint8_t* places,
           float* of_image) {
    const std::size_t outputs = shape_.out_width() * shape_.out_channels;
    image_.load(images, number);
    if (of_image) std::fill(of_image_.values.begin(), of_image_.values.end(), 0.0F);
    for (std::size_t row = 0; row < shape_.out_height(); ++row)
      add_row(row, gradient + row * outputs, places + row * outputs, of_image != nullptr);
    if (of_image) of_image_.store(of_image);
  }

  std::vector<float> weights, bias;  // weights as filters

 private:
  // Behind a list is room for a term that does not count: lists have no branch, which would be mispredicted, since
  // ReLU gives 0 as often as not.
  std::size_t longest_list() const { return std::max(shape_.out_width(), shape_.out_channels) + 1; }

  void add_row(std::size_t row, const float* gradient, const std::uint8_t* places, bool to_image) {
    const std::size_t channels = shape_.out_channels;
    for (std::size_t column = 0; to_image && column < shape_.out_width(); ++column)
      add_to_image(image_.corner(row, column), gradient + column * channels, places + column * channels);
    const std::array<std::size_t, kNone + 1> to = places_in_image();
    for (std::size_t out = 0; out < channels; ++out) {
      Term* end = terms_.data();
      for (std::size_t column = 0; column < shape_.out_width(); ++column) {
        const std::uint8_t place = places[column * channels + out];
        *end = {image_.corner(row, column) + to[place], gradient[column * channels + out]};
        end += place != kNone;
      }
      for (const Term* term = terms_.data(); term != end; ++term) bias[out] += term->factor;
      add_patches({&weights[out * kRows * wide_], wide_}, {image_.values.data(), image_.stride}, terms_.data(), end,
                  wide_);
    }
  }

  // An output's patches add up filters.
  void add_to_image(std::size_t corner, const float* gradient, const std::uint8_t* places) {
    std::array<Term*, kNone + 1> ends;
    for (std::size_t place = 0; place < ends.size(); ++place) ends[place] = &terms_[place * longest_list()];
    for (std::size_t out = 0; out < shape_.out_channels; ++out)
      *ends[places[out]]++ = {out * kRows * wide_, gradient[out]};
    const std::array<std::size_t, kNone + 1> to = places_in_image();
    for (std::size_t place = 0; place < kNone; ++place)
      add_patches({&of_image_.values[corner + to[place]], image_.stride}, {filters_.data(), wide_},
                  &terms_[place * longest_list()], ends[place], wide_);
  }

  // Those of an output's patches behind the first; any for kNone.
  std::array<std::size_t, kNone + 1> places_in_image() const {
    return {image_.to(0), image_.to(1), image_.to(2), image_.to(3), 0};
  }

  Shape shape_;
  std::size_t wide_;
  const std::vector<float>& filters_;
  Padded image_, of_image_;
  std::vector<Term> terms_;
};

}  // namespace

void PooledConvolution::forward(const Shape& shape, const Images& images, const float* weights, const float* bias,
                                float* out, std::uint8_t* places) {
  const std::lock_guard lock(one_at_a_time_);
  const std::size_t row_size = row_of(shape), filter = kRows * row_size;
  std::vector<float> blocks(shape.out_channels * filter);  // (out_channels / kBlock, kRows, row, kBlock)
  for_weights(shape, [&](std::size_t at, std::size_t of, std::size_t row, std::size_t k) {
    blocks[((of / kBlock * kRows + row) * row_size + k) * kBlock + of % kBlock] = weights[at];
  });
  parallel_.for_each(kParts, [&](int part, unsigned) {
    if (first_of(part, shape) == first_of(part + 1, shape)) return;
    Padded image(shape);
    for (std::size_t i = first_of(part, shape); i < first_of(part + 1, shape); ++i) {
      image.load(images, i);
      for (std::size_t block = 0; block < shape.out_channels; block += kBlock) {
        std::size_t to = i * shape.out_height() * shape.out_width() * shape.out_channels + block;
        for (std::size_t row = 0; row < shape.out_height(); ++row)
          for (std::size_t column = 0; column < shape.out_width(); ++column, to += shape.out_channels)
            pool_patches(&image.values[image.corner(row, column)], image.stride, shape.channels,
                         &blocks[block * filter], bias + block, out + to, places + to);
      }
    }
  });
}

void PooledConvolution::backward(const Shape& shape, const Images& images, const float* weights, const float* gradient,
                                 const std::uint8_t* places, float* of_images, float* of_weights, float* of_bias) {
  const std::lock_guard lock(one_at_a_time_);
  const std::size_t wide = wide_row_of(shape), image_size = shape.height * shape.width * shape.channels;
  const std::size_t outputs = shape.out_height() * shape.out_width() * shape.out_channels;
  std::vector<float> filters(shape.out_channels * kRows * wide, 0.0F);
  for_weights(shape, [&](std::size_t at, std::size_t out, std::size_t row, std::size_t k) {
    filters[(out * kRows + row) * wide + k] = weights[at];
  });
  std::vector<std::optional<PartGradients>> parts(kParts);
  parallel_.for_each(kParts, [&](int part, unsigned) {
    PartGradients& sums = parts[static_cast<std::size_t>(part)].emplace(shape, filters);
    for (std::size_t i = first_of(part, shape); i < first_of(part + 1, shape); ++i)
      sums.add(images, i, gradient + i * outputs, places + i * outputs,
               of_images ? of_images + i * image_size : nullptr);
  });
  PartGradients& all = *parts.front();
  for (std::size_t part = 1; part < kParts; ++part) {
    for (std::size_t i = 0; i < all.weights.size(); ++i) all.weights[i] += parts[part]->weights[i];
    for (std::size_t out = 0; out < shape.out_channels; ++out) all.bias[out] += parts[part]->bias[out];
  }
  for_weights(shape, [&](std::size_t at, std::size_t out, std::size_t row, std::size_t k) {
    of_weights[at] = all.weights[(out * kRows + row) * wide + k];
  });
  std::copy(all.bias.begin(), all.bias.end(), of_bias);
}

}  // namespace relign::python
