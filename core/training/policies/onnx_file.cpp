#include "onnx_file.hpp"

#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace relign::policies {
namespace {

constexpr std::int64_t kFloat = 1;  // TensorProto.DataType
constexpr std::int64_t kLargestTensor = 64 << 20;

[[noreturn]] void damaged(const std::string& what) { throw std::runtime_error("not an ONNX network: " + what); }

// Reads one Protocol Buffers message, field by field.
class Message {
 public:
  explicit Message(std::string_view bytes) : rest_(bytes) {}

  // Advances to the next field; false at the end. The functions below read its content.
  bool next() {
    if (rest_.empty()) return false;
    const std::uint64_t key = varint(rest_);
    field = key >> 3;
    type_ = key & 7;
    if (type_ == 0)
      number_ = varint(rest_);
    else if (type_ == 2)
      content_ = taken(varint(rest_));
    else if (type_ == 1 || type_ == 5)
      content_ = taken(type_ == 1 ? 8 : 4);
    else
      damaged("unknown wire type " + std::to_string(type_));
    return true;
  }

  std::int64_t integer() const {
    expect(0);
    return static_cast<std::int64_t>(number_);
  }
  float real() const {
    expect(5);
    return floats_of(content_)[0];
  }
  std::string_view bytes() const {
    expect(2);
    return content_;
  }
  std::string text() const { return std::string(bytes()); }
  // Repeated numbers are stored one by one or packed.
  void add_to(std::vector<std::int64_t>& integers) const {
    if (type_ == 0) {
      integers.push_back(integer());
      return;
    }
    for (std::string_view packed = bytes(); !packed.empty();)
      integers.push_back(static_cast<std::int64_t>(varint(packed)));
  }
  void add_to(std::vector<float>& reals) const {
    if (type_ == 5) {
      reals.push_back(real());
      return;
    }
    const std::vector<float> packed = floats_of(bytes());
    reals.insert(reals.end(), packed.begin(), packed.end());
  }
  static std::vector<float> floats_of(std::string_view bytes) {
    if (bytes.size() % sizeof(float) != 0) damaged("array of numbers of invalid length");
    std::vector<float> values(bytes.size() / sizeof(float));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());  // both little-endian
    return values;
  }

  std::uint64_t field = 0;

 private:
  static std::uint64_t varint(std::string_view& bytes) {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      if (bytes.empty()) damaged("truncated file");
      const auto byte = static_cast<unsigned char>(bytes.front());
      bytes.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 127U) << shift;
      if (byte < 128) return value;
    }
    damaged("integer of more than 64 bits");
  }
  std::string_view taken(std::uint64_t length) {
    if (length > rest_.size()) damaged("truncated file");
    const std::string_view bytes = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return bytes;
  }
  void expect(std::uint64_t type) const {
    if (type_ != type) damaged("field " + std::to_string(field) + " has wire type " + std::to_string(type_));
  }

  std::string_view rest_, content_;
  std::uint64_t type_ = 0, number_ = 0;
};

struct NamedTensor {
  std::string name;
  std::int64_t type = 0;
  OnnxTensor tensor;
};

NamedTensor tensor_of(std::string_view bytes) {
  NamedTensor read;
  std::string_view raw;
  for (Message message(bytes); message.next();) {
    if (message.field == 1) message.add_to(read.tensor.dims);
    if (message.field == 2) read.type = message.integer();
    if (message.field == 4) message.add_to(read.tensor.values);
    if (message.field == 8) read.name = message.text();
    if (message.field == 9) raw = message.bytes();
    if (message.field == 14 && message.integer() != 0)
      damaged("weights are stored in another file; export them into one");
  }
  if (read.type != kFloat) return read;  // values are dropped; an operator that needs them is refused
  if (!raw.empty()) read.tensor.values = Message::floats_of(raw);
  std::int64_t count = 1;
  for (const std::int64_t dim : read.tensor.dims) {
    if (dim < 0 || dim > kLargestTensor || (dim > 0 && count > kLargestTensor / dim))
      damaged("tensor '" + read.name + "' has an invalid shape");
    count *= dim;
  }
  if (static_cast<std::size_t>(count) != read.tensor.values.size())
    damaged("tensor '" + read.name + "' has " + std::to_string(read.tensor.values.size()) +
            " values; its shape needs " + std::to_string(count));
  return read;
}

void read_attribute(std::string_view bytes, OnnxNode& node) {
  std::string name;
  std::vector<std::int64_t> integers;
  std::optional<float> real;
  std::optional<std::string> text;
  std::optional<NamedTensor> tensor;
  for (Message message(bytes); message.next();) {
    if (message.field == 1) name = message.text();
    if (message.field == 2) real = message.real();
    if (message.field == 3 || message.field == 8) message.add_to(integers);
    if (message.field == 4) text = message.text();
    if (message.field == 5) tensor = tensor_of(message.bytes());
  }
  if (!integers.empty()) node.integers[name] = std::move(integers);
  if (real) node.floats[name] = *real;
  if (text) node.texts[name] = std::move(*text);
  if (tensor && tensor->type == kFloat) node.tensors[name] = std::move(tensor->tensor);
}

OnnxNode node_of(std::string_view bytes) {
  OnnxNode node;
  std::string domain;
  for (Message message(bytes); message.next();) {
    if (message.field == 1) node.inputs.push_back(message.text());
    if (message.field == 2) node.outputs.push_back(message.text());
    if (message.field == 3) node.name = message.text();
    if (message.field == 4) node.op = message.text();
    if (message.field == 5) read_attribute(message.bytes(), node);
    if (message.field == 7) domain = message.text();
  }
  if (!domain.empty() && domain != "ai.onnx") node.op = domain + "." + node.op;
  return node;
}

// ValueInfoProto: the name, and the dimensions in type.tensor_type.shape, 0 where one is symbolic.
std::pair<std::string, std::vector<std::int64_t>> value_of(std::string_view bytes) {
  std::pair<std::string, std::vector<std::int64_t>> read;
  const auto each = [](std::string_view within, std::uint64_t field, const auto& then) {
    for (Message message(within); message.next();)
      if (message.field == field) then(message.bytes());
  };
  each(bytes, 1, [&](std::string_view name) { read.first = name; });
  each(bytes, 2, [&](std::string_view type) {
    each(type, 1, [&](std::string_view tensor) {
      for (Message message(tensor); message.next();)
        if (message.field == 2)
          each(message.bytes(), 1, [&](std::string_view dim) {
            read.second.push_back(0);
            for (Message value(dim); value.next();)
              if (value.field == 1) read.second.back() = value.integer();
          });
    });
  });
  return read;
}

OnnxGraph graph_of(std::string_view bytes) {
  OnnxGraph graph;
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> inputs;
  std::vector<std::string> outputs;
  for (Message message(bytes); message.next();) {
    if (message.field == 1) graph.nodes.push_back(node_of(message.bytes()));
    if (message.field == 5)
      if (NamedTensor read = tensor_of(message.bytes()); read.type == kFloat)
        graph.constants[read.name] = std::move(read.tensor);
    if (message.field == 11) inputs.push_back(value_of(message.bytes()));
    if (message.field == 12) outputs.push_back(value_of(message.bytes()).first);
  }
  // Before version 4 of the format initializers are also listed as inputs.
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> own;
  for (auto& input : inputs)
    if (!graph.constants.count(input.first)) own.push_back(std::move(input));
  if (own.empty() || own.size() > 2 || outputs.size() != 1)
    damaged("must have one input, or images and a history, and one output, found " + std::to_string(own.size()) +
            " and " + std::to_string(outputs.size()));
  for (auto& [name, dims] : own) graph.inputs.push_back({std::move(name), std::move(dims)});
  graph.output = outputs[0];
  return graph;
}

}  // namespace

std::int64_t OnnxNode::integer(const std::string& attribute, std::int64_t otherwise) const {
  const auto found = integers.find(attribute);
  return found != integers.end() ? found->second.front() : otherwise;
}

float OnnxNode::number(const std::string& attribute, float otherwise) const {
  const auto found = floats.find(attribute);
  return found != floats.end() ? found->second : otherwise;
}

OnnxGraph read_onnx(const std::string& bytes) {
  std::string_view graph;
  std::int64_t opset = 0;
  for (Message message(bytes); message.next();) {
    if (message.field == 7) graph = message.bytes();
    if (message.field != 8) continue;
    std::string domain;
    std::int64_t version = 0;
    for (Message set(message.bytes()); set.next();) {
      if (set.field == 1) domain = set.text();
      if (set.field == 2) version = set.integer();
    }
    if (domain.empty() || domain == "ai.onnx") opset = version;
  }
  if (graph.empty()) damaged("it has no operators");
  OnnxGraph read = graph_of(graph);
  read.opset = opset;
  return read;
}

}  // namespace relign::policies
