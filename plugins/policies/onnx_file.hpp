// An ONNX file as data: operators in order, constants, input and output. Reads the format itself (onnx.proto 3 in
// Protocol Buffers' wire format, https://protobuf.dev/programming-guides/encoding); runs nothing.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace relign::policies {

struct OnnxTensor {
  std::vector<std::int64_t> dims;  // none: a scalar
  std::vector<float> values;       // as many as the product of dims
};

struct OnnxNode {
  std::string op;    // "Conv"; of another domain than ONNX's own "domain.Op"
  std::string name;  // for messages, may be empty
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
  std::map<std::string, OnnxTensor> constants;  // initializers; of type float alone
  std::string input, output;                    // names
  std::vector<std::int64_t> input_dims;         // 0 where the file leaves one open
};

// Throws std::runtime_error with what is wrong: damaged, weights outside of the file, several inputs or outputs.
OnnxGraph read_onnx(const std::string& bytes);

}  // namespace relign::policies
