// The portable operators. Each function checks one node, packs its weights and returns a function that runs it. Results
// have the same bits on every processor: sums and products in a fixed order, no elementary functions of the C library.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "onnx_file.hpp"

namespace relign::policies {

// Shape of a value for a batch of one: a row of `channels` numbers if `flat`, otherwise an image stored as
// height x width x channels.
struct Shape {
  std::int64_t channels = 0, height = 1, width = 1;
  bool flat = false;

  std::size_t count() const { return static_cast<std::size_t>(channels * height * width); }
};

// An input of a node: an operand, a constant, or neither if an optional input is omitted.
struct LayerInput {
  const Shape* operand = nullptr;
  const OnnxTensor* constant = nullptr;
};

// Computes `output`, which is allocated by the caller, from the operands in the node's order.
using Run = std::function<void(const std::vector<const float*>& operands, float* output)>;

struct Layer {
  Shape shape;  // of the output
  Run run;
};

// Throws std::runtime_error if the node uses an unsupported feature.
using MakeLayer = Layer (*)(const OnnxNode& node, const std::vector<LayerInput>& inputs);

// Null for an unsupported operator.
MakeLayer layer_of(const std::string& op);
// Names of all supported operators, separated by ", ".
std::string layer_names();

}  // namespace relign::policies
