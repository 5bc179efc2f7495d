// The operators of a portable network: each function checks one node, packs its weights, and returns what runs it.
// Every result is the same bits on every processor: plain sums and products in a fixed order, no elementary function
// of the C library.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "onnx_file.hpp"

namespace relign::policies {

// What passes between operators, for one input at a time. With `flat` one row of `channels` numbers; else a picture,
// stored as height x width x channels.
struct Shape {
  std::int64_t channels = 0, height = 1, width = 1;
  bool flat = false;

  std::size_t count() const { return static_cast<std::size_t>(channels * height * width); }
};

// What a node is given: an operand, or a constant, or neither where an optional input is left out.
struct LayerInput {
  const Shape* operand = nullptr;
  const OnnxTensor* constant = nullptr;
};

// From the operands' numbers, in the node's order, to the output, which has its size already.
using Run = std::function<void(const std::vector<const float*>& operands, float* output)>;

struct Layer {
  Shape shape;  // of the output
  Run run;
};

// Throws std::runtime_error with what of the node is not supported.
using MakeLayer = Layer (*)(const OnnxNode& node, const std::vector<LayerInput>& inputs);

// Null where there is no operator of this name.
MakeLayer layer_of(const std::string& op);
// Names of all operators, separated by ", ".
std::string layer_names();

}  // namespace relign::policies
