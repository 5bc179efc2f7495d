// The inner loop of convolutions and matrix products, compiled once for each instruction set.
//
// Each output is a sum in a fixed order: the bias, then the products by increasing index, each rounded before it is
// added (no fused multiply-add). Lanes and tiles hold different outputs, so all builds give the same bits. This header
// is compiled for several instruction sets: plain data only, no inline functions.
#pragma once

#include <cstddef>

namespace relign::policies {

constexpr int kLanes = 16;  // outputs per block of weights

// output[p * outputs + n] = bias[n] + sum over run, i of
//     input[p * pixel_stride + run * run_stride + i] * weights[((n / 16) * K + run * run_length + i) * 16 + n % 16]
// with K = runs * run_length; bias and weights are padded to whole blocks of 16 outputs.
struct Product {
  const float* input;
  std::ptrdiff_t pixel_stride, run_stride;
  int pixels, runs, run_length, outputs;
  const float* weights;
  const float* bias;
  float* output;
};
using Multiply = void (*)(const Product&);

namespace generic {
void multiply(const Product& product);
}
namespace avx2 {
void multiply(const Product& product);
}
namespace avx512 {
void multiply(const Product& product);
}

}  // namespace relign::policies
