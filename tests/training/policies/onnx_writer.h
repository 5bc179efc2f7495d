// Writes small ONNX files for tests, field by field in the Protocol Buffers wire format.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace relign::policies::test {

inline std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 128; value >>= 7) bytes += static_cast<char>((value & 127) | 128);
  return bytes + static_cast<char>(value);
}
inline std::string number(unsigned field, std::int64_t value) {
  return varint(field << 3) + varint(static_cast<std::uint64_t>(value));
}
inline std::string bytes(unsigned field, const std::string& content) {
  return varint(field << 3 | 2) + varint(content.size()) + content;
}
inline std::string raw(const void* data, std::size_t size) { return {static_cast<const char*>(data), size}; }

inline std::string tensor(const std::string& name, const std::vector<std::int64_t>& dims,
                          const std::vector<float>& values) {
  std::string text;
  for (const std::int64_t dim : dims) text += number(1, dim);
  return text + number(2, 1) + bytes(8, name) + bytes(9, raw(values.data(), values.size() * sizeof(float)));
}
inline std::string integers(const std::string& name, const std::vector<std::int64_t>& values) {
  std::string text = bytes(1, name);
  for (const std::int64_t value : values) text += number(8, value);
  return bytes(5, text + number(20, 7));
}
inline std::string integer(const std::string& name, std::int64_t value) {
  return bytes(5, bytes(1, name) + number(3, value) + number(20, 2));
}
inline std::string real(const std::string& name, float value) {
  return bytes(5, bytes(1, name) + varint(2 << 3 | 5) + raw(&value, sizeof value) + number(20, 1));
}

// A chain of operators from input "x" (1 x frames x size x size, or a row) to the output of the last one.
class Chain {
 public:
  Chain(std::int64_t frames, std::int64_t size, std::int64_t opset = 13) : Chain({1, frames, size, size}, opset) {}
  static Chain of_row(std::int64_t numbers) { return Chain({1, numbers}, 13); }
  // attributes: the concatenated results of the functions above.
  Chain& then(const std::string& op, const std::vector<std::string>& weights = {}, const std::string& attributes = "") {
    std::string inputs = bytes(1, last_);
    for (const std::string& weight : weights) inputs += bytes(1, weight);
    last_ = "v" + std::to_string(++count_);
    nodes_ +=
        bytes(1, inputs + bytes(2, last_) + bytes(3, "node" + std::to_string(count_)) + bytes(4, op) + attributes);
    return *this;
  }
  Chain& weight(const std::string& name, const std::vector<std::int64_t>& dims, const std::vector<float>& values) {
    nodes_ += bytes(5, tensor(name, dims, values));
    return *this;
  }
  std::string file() const {
    return number(1, 7) +
           bytes(7, nodes_ + bytes(2, "test") + input_ +
                        bytes(12, bytes(1, last_) + bytes(2, bytes(1, number(1, 1) + bytes(2, ""))))) +
           bytes(8, bytes(1, "") + number(2, opset_));
  }

 private:
  Chain(const std::vector<std::int64_t>& shape, std::int64_t opset) : opset_(opset) {
    std::string dims;
    for (const std::int64_t dim : shape) dims += bytes(1, number(1, dim));
    input_ = bytes(11, bytes(1, "x") + bytes(2, bytes(1, number(1, 1) + bytes(2, dims))));
  }

  std::string nodes_, input_, last_ = "x";
  int count_ = 0;
  std::int64_t opset_;
};

}  // namespace relign::policies::test
