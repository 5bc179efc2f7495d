// Compiled once for each instruction set (RELIGN_KERNEL_ISA). Uses no inline functions of headers: the linker could
// keep a copy with instructions that the processor lacks.
#include "dense_kernel.hpp"

namespace relign::policies {
namespace RELIGN_KERNEL_ISA {
namespace {

// A tile of pixels and blocks takes about three quarters of the registers; the rest holds weights and products.
#if defined(__AVX512F__)
constexpr int kWidth = 16, kPixels = 12, kRowBlocks = 8;
#elif defined(__AVX2__)
constexpr int kWidth = 8, kPixels = 6, kRowBlocks = 4;
#else
constexpr int kWidth = 4, kPixels = 2, kRowBlocks = 2;
#endif
constexpr int kParts = kLanes / kWidth;
typedef float Vector __attribute__((vector_size(kWidth * sizeof(float)), aligned(alignof(float)), may_alias));

template <int pixels, int blocks>
inline __attribute__((always_inline)) void tile(const Product& of, int pixel, int block) {
  const std::ptrdiff_t block_size = static_cast<std::ptrdiff_t>(of.runs) * of.run_length * kLanes;
  const float* weights = of.weights + block * block_size;
  Vector sums[pixels][blocks][kParts];
  for (int p = 0; p < pixels; ++p)
    for (int b = 0; b < blocks; ++b)
      for (int v = 0; v < kParts; ++v)
        sums[p][b][v] = *reinterpret_cast<const Vector*>(of.bias + (block + b) * kLanes + v * kWidth);
  for (int run = 0; run < of.runs; ++run) {
    const float* input = of.input + pixel * of.pixel_stride + run * of.run_stride;
    for (int i = 0; i < of.run_length; ++i, weights += kLanes)
      for (int b = 0; b < blocks; ++b)
        for (int v = 0; v < kParts; ++v) {
          const Vector weight = *reinterpret_cast<const Vector*>(weights + b * block_size + v * kWidth);
          for (int p = 0; p < pixels; ++p) sums[p][b][v] += weight * input[p * of.pixel_stride + i];
        }
  }
  for (int p = 0; p < pixels; ++p)
    for (int b = 0; b < blocks; ++b) {
      float* output = of.output + (pixel + p) * static_cast<std::ptrdiff_t>(of.outputs) + (block + b) * kLanes;
      const int left = of.outputs - (block + b) * kLanes;
      for (int n = 0; n < kLanes && n < left; ++n) output[n] = sums[p][b][n / kWidth][n % kWidth];
    }
}

template <int pixels>
void row_of_tiles(const Product& of, int pixel, int blocks) {
  for (int block = 0; block < blocks; ++block) tile<pixels, 1>(of, pixel, block);
}

// The last pixels of a row, fewer than kPixels.
template <int pixels>
void rest(const Product& of, int pixel, int blocks) {
  if constexpr (pixels > 1) {
    if (of.pixels - pixel == pixels)
      row_of_tiles<pixels>(of, pixel, blocks);
    else
      rest<pixels - 1>(of, pixel, blocks);
  } else if (of.pixels - pixel == 1) {
    int block = 0;
    for (; block + kRowBlocks <= blocks; block += kRowBlocks) tile<1, kRowBlocks>(of, pixel, block);
    for (; block < blocks; ++block) tile<1, 1>(of, pixel, block);
  }
}

}  // namespace

void multiply(const Product& product) {
  const int blocks = (product.outputs + kLanes - 1) / kLanes;
  int pixel = 0;
  for (; pixel + kPixels <= product.pixels; pixel += kPixels) row_of_tiles<kPixels>(product, pixel, blocks);
  rest<kPixels - 1>(product, pixel, blocks);
}

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::policies
