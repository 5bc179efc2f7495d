// The layers of the paper's network on a CPU: a convolution (3 x 3, stride 2, padded by 1), 2 x 2 pooling by the
// maximum, and ReLU. Faster than a library's separate layers, because pooling discards three of four gradients: only
// the patches whose value was the maximum enter the gradients.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>

#include "base/parallel.h"

namespace relign::python {

class PooledConvolution {
 public:
  static constexpr std::size_t kBlock = 16;  // out_channels is a multiple of it

  // Weights are (out_channels, channels, 3, 3); other arrays have the channels last, so that a row of a patch is
  // contiguous. Arrays without strides are contiguous.
  struct Shape {
    std::size_t images = 0, height = 0, width = 0, channels = 0, out_channels = 0;
    std::size_t out_height() const { return (height + 1) / 4; }
    std::size_t out_width() const { return (width + 1) / 4; }
  };
  struct Images {
    const float* first = nullptr;
    std::size_t image = 0, row = 0, column = 0, channel = 0;  // from one to the next, in numbers
  };

  explicit PooledConvolution(unsigned threads) : parallel_(threads) {}

  // out: (images, out_height, out_width, out_channels). places: of the same shape, which of its four values each output
  // is, row by row; kNone where ReLU gives 0.
  static constexpr std::uint8_t kNone = 4;
  void forward(const Shape& shape, const Images& images, const float* weights, const float* bias, float* out,
               std::uint8_t* places);

  // The gradients for `gradient`, that of `out`. of_images, contiguous, may be null. The bits do not depend on the
  // number of threads.
  void backward(const Shape& shape, const Images& images, const float* weights, const float* gradient,
                const std::uint8_t* places, float* of_images, float* of_weights, float* of_bias);

 private:
  Parallel parallel_;
  std::mutex one_at_a_time_;
};

}  // namespace relign::python
