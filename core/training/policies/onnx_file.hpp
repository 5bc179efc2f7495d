// Parses an ONNX file (onnx.proto 3 in the Protocol Buffers wire format,
// https://protobuf.dev/programming-guides/encoding) into operators in order, constants, inputs and output.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace relign::policies {

struct OnnxTensor {
  std::vector<std::int64_t> dims;  // empty for a scalar
  std::vector<float> values;       // the product of dims of them
};

struct OnnxNode {
  std::string op;    // "Conv"; "domain.Op" outside ONNX's own domain
  std::string name;  // for error messages, may be empty
  std::vector<std::string> inputs, outputs;
  std::map<std::string, std::vector<std::int64_t>> integers;
  std::map<std::string, float> floats;
  std::map<std::string, std::string> texts;
  std::map<std::string, OnnxTensor> tensors;

  std::int64_t integer(const std::string& attribute, std::int64_t otherwise) const;
  float number(const std::string& attribute, float otherwise) const;
};

struct OnnxGraph {
  std::int64_t opset = 0;
  std::vector<OnnxNode> nodes;
  std::map<std::string, OnnxTensor> constants;  // initializers of type float
  struct Input {
    std::string name;
    std::vector<std::int64_t> dims;  // 0 where a dimension is symbolic
  };
  std::vector<Input> inputs;  // one or two
  std::string output;         // name
};

// bytes: the content of the file. Throws std::runtime_error if it is damaged, stores weights in another file, or has
// more than two inputs or several outputs.
OnnxGraph read_onnx(const std::string& bytes);

}  // namespace relign::policies
