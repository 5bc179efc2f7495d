#include "layers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <relign/instruction_set.hpp>
#include <relign/portable_math.hpp>
#include <stdexcept>

#include "dense_kernel.hpp"

namespace relign::policies {
namespace {

// Limits that keep every count within 64 bits, far above what networks for images need.
constexpr std::int64_t kLargestStep = 256;        // of strides and pads
constexpr std::int64_t kLargestKernel = 1024;     // rows, columns
constexpr std::int64_t kMaxOutputs = 1 << 20;     // channels, or numbers of a row
constexpr std::int64_t kLargestValue = 64 << 20;  // numbers in weights or padded inputs
using Inputs = std::vector<LayerInput>;
using Operands = std::vector<const float*>;

Multiply multiply() {
  static const Multiply chosen = [] {
    switch (chosen_instruction_set()) {
#if defined(__x86_64__)
      case InstructionSet::avx512:
        return &avx512::multiply;
      case InstructionSet::avx2:
        return &avx2::multiply;
#endif
      default:
        return &generic::multiply;
    }
  }();
  return chosen;
}

const Shape& operand_of(const Inputs& inputs, std::size_t place) {
  if (place >= inputs.size() || !inputs[place].operand)
    throw std::runtime_error("input " + std::to_string(place) + " must be computed by an operator");
  return *inputs[place].operand;
}

const OnnxTensor& constant_of(const Inputs& inputs, std::size_t place, std::size_t dims) {
  if (place >= inputs.size() || !inputs[place].constant || inputs[place].constant->dims.size() != dims ||
      inputs[place].constant->values.empty())
    throw std::runtime_error("input " + std::to_string(place) + " must be constant weights of " + std::to_string(dims) +
                             " dimensions");
  return *inputs[place].constant;
}

const Shape& picture_of(const Inputs& inputs) {
  if (operand_of(inputs, 0).flat) throw std::runtime_error("the input must have 4 dimensions");
  return operand_of(inputs, 0);
}

const Shape& row_of(const Inputs& inputs) {
  if (!operand_of(inputs, 0).flat) throw std::runtime_error("the input must have 2 dimensions");
  return operand_of(inputs, 0);
}

// Weights in the kernel's order.
struct Packed {
  std::int64_t outputs, depth;  // depth: number of products summed for one output
  std::vector<float> weights, bias;

  // bias: null for zeros.
  Packed(std::int64_t outputs_, std::int64_t depth_, const OnnxTensor* bias_) : outputs(outputs_), depth(depth_) {
    const std::int64_t padded = (outputs + kLanes - 1) / kLanes * kLanes;
    if (outputs < 1 || outputs > kMaxOutputs || depth < 1 || padded > kLargestValue / depth)
      throw std::runtime_error("weights of " + std::to_string(outputs) + " x " + std::to_string(depth) +
                               " are not supported");
    weights.assign(static_cast<std::size_t>(padded * depth), 0.0F);
    bias.assign(static_cast<std::size_t>(padded), 0.0F);
    if (!bias_) return;
    if (bias_->values.size() != static_cast<std::size_t>(outputs))
      throw std::runtime_error("the bias has " + std::to_string(bias_->values.size()) + " values; must have " +
                               std::to_string(outputs));
    std::copy(bias_->values.begin(), bias_->values.end(), bias.begin());
  }
  float& at(std::int64_t output, std::int64_t k) {
    return weights[static_cast<std::size_t>((output / kLanes * depth + k) * kLanes + output % kLanes)];
  }
};

// Kernel, strides and pads of a convolution or pooling.
struct Window {
  std::int64_t rows, columns, down, across, top, left, bottom, right;

  Window(const OnnxNode& node, std::int64_t rows_, std::int64_t columns_) : rows(rows_), columns(columns_) {
    const auto read = [&node](const char* attribute, std::size_t count, std::int64_t otherwise) {
      const auto found = node.integers.find(attribute);
      if (found == node.integers.end()) return std::vector<std::int64_t>(count, otherwise);
      for (const std::int64_t value : found->second)
        if (found->second.size() != count || value < otherwise || value > kLargestStep)
          throw std::runtime_error(std::string("attribute '") + attribute + "' must have " + std::to_string(count) +
                                   " values from " + std::to_string(otherwise) + " to " + std::to_string(kLargestStep));
      return found->second;
    };
    if (const auto found = node.texts.find("auto_pad"); found != node.texts.end() && found->second != "NOTSET")
      throw std::runtime_error("auto_pad '" + found->second + "' is not supported; export explicit pads");
    for (const std::int64_t dilation : read("dilations", 2, 1))
      if (dilation != 1) throw std::runtime_error("dilations are not supported");
    if (node.integer("ceil_mode", 0) != 0) throw std::runtime_error("ceil_mode is not supported");
    const std::vector<std::int64_t> strides = read("strides", 2, 1), pads = read("pads", 4, 0);
    down = strides[0], across = strides[1];
    top = pads[0], left = pads[1], bottom = pads[2], right = pads[3];
  }

  Shape output(const Shape& input, std::int64_t channels) const {
    if (rows < 1 || columns < 1 || rows > kLargestKernel || columns > kLargestKernel)
      throw std::runtime_error("a kernel of " + std::to_string(rows) + " x " + std::to_string(columns) +
                               " is not supported; must be 1 to " + std::to_string(kLargestKernel) + " a side");
    const std::int64_t height = input.height + top + bottom - rows, width = input.width + left + right - columns;
    if (height < 0 || width < 0)
      throw std::runtime_error("a kernel of " + std::to_string(rows) + " x " + std::to_string(columns) +
                               " is too large for an input of " + std::to_string(input.height) + " x " +
                               std::to_string(input.width));
    return {channels, height / down + 1, width / across + 1, false};
  }
};

Layer convolution(const OnnxNode& node, const Inputs& inputs) {
  const Shape in = picture_of(inputs);
  const OnnxTensor& weights = constant_of(inputs, 1, 4);
  if (node.integer("group", 1) != 1) throw std::runtime_error("groups are not supported");
  if (weights.dims[1] != in.channels)
    throw std::runtime_error("the weights are for " + std::to_string(weights.dims[1]) + " channels, the input has " +
                             std::to_string(in.channels));
  const Window window(node, weights.dims[2], weights.dims[3]);
  const Shape out = window.output(in, weights.dims[0]);
  const bool biased = inputs.size() > 2 && (inputs[2].constant || inputs[2].operand);
  Packed packed(out.channels, in.channels * window.rows * window.columns,
                biased ? &constant_of(inputs, 2, 1) : nullptr);
  std::size_t from = 0;
  for (std::int64_t output = 0; output < out.channels; ++output)
    for (std::int64_t channel = 0; channel < in.channels; ++channel)
      for (std::int64_t place = 0; place < window.rows * window.columns; ++place)
        packed.at(output, place * in.channels + channel) = weights.values[from++];

  const std::int64_t row = (in.width + window.left + window.right) * in.channels;
  const std::int64_t rows = in.height + window.top + window.bottom;
  if (rows > kLargestValue / row) throw std::runtime_error("the padded input is too large");
  std::vector<float> padded(static_cast<std::size_t>(rows * row), 0.0F);
  const auto run = [=, packed = std::move(packed), padded = std::move(padded)](const Operands& operands,
                                                                               float* output) mutable {
    const std::int64_t used = in.width * in.channels;
    for (std::int64_t y = 0; y < in.height; ++y)
      std::copy_n(operands[0] + y * used, used, padded.data() + (y + window.top) * row + window.left * in.channels);
    Product product{padded.data(),
                    window.across * in.channels,
                    row,
                    static_cast<int>(out.width),
                    static_cast<int>(window.rows),
                    static_cast<int>(window.columns * in.channels),
                    static_cast<int>(out.channels),
                    packed.weights.data(),
                    packed.bias.data(),
                    output};
    for (std::int64_t y = 0; y < out.height; ++y) {
      multiply()(product);
      product.input += window.down * row;
      product.output += out.width * out.channels;
    }
  };
  return {out, run};
}

// A row times a matrix whose element (k, output) is values[k * down + output * across].
Layer matrix_product(const Shape& in, const OnnxTensor& matrix, std::int64_t down, std::int64_t across,
                     std::int64_t depth, std::int64_t outputs, float factor, const OnnxTensor* bias) {
  if (depth != in.channels)
    throw std::runtime_error("the weights are for " + std::to_string(depth) + " values, the input has " +
                             std::to_string(in.channels));
  Packed packed(outputs, depth, bias);
  for (std::int64_t output = 0; output < outputs; ++output)
    for (std::int64_t k = 0; k < depth; ++k)
      packed.at(output, k) = factor * matrix.values[static_cast<std::size_t>(k * down + output * across)];
  const auto run = [packed = std::move(packed)](const Operands& operands, float* output) {
    multiply()({operands[0], 0, 0, 1, 1, static_cast<int>(packed.depth), static_cast<int>(packed.outputs),
                packed.weights.data(), packed.bias.data(), output});
  };
  return {{outputs, 1, 1, true}, run};
}

Layer gemm(const OnnxNode& node, const Inputs& inputs) {
  const Shape& in = row_of(inputs);
  const OnnxTensor& matrix = constant_of(inputs, 1, 2);
  if (node.integer("transA", 0) != 0) throw std::runtime_error("transA is not supported");
  const bool turned = node.integer("transB", 0) != 0;
  const std::int64_t rows = matrix.dims[0], columns = matrix.dims[1];
  OnnxTensor bias;
  const bool biased = inputs.size() > 2 && (inputs[2].constant || inputs[2].operand);
  if (biased) {
    bias = constant_of(inputs, 2, 1);
    for (float& value : bias.values) value *= node.number("beta", 1);
  }
  return matrix_product(in, matrix, turned ? 1 : columns, turned ? columns : 1, turned ? columns : rows,
                        turned ? rows : columns, node.number("alpha", 1), biased ? &bias : nullptr);
}

Layer matmul(const OnnxNode&, const Inputs& inputs) {
  const OnnxTensor& matrix = constant_of(inputs, 1, 2);
  return matrix_product(row_of(inputs), matrix, matrix.dims[1], 1, matrix.dims[0], matrix.dims[1], 1, nullptr);
}

Layer max_pool(const OnnxNode& node, const Inputs& inputs) {
  const Shape in = picture_of(inputs);
  const auto kernel = node.integers.find("kernel_shape");
  if (kernel == node.integers.end() || kernel->second.size() != 2)
    throw std::runtime_error("attribute 'kernel_shape' must have 2 values");
  const Window window(node, kernel->second[0], kernel->second[1]);
  const Shape out = window.output(in, in.channels);
  if (std::max(window.top, window.bottom) >= window.rows || std::max(window.left, window.right) >= window.columns)
    throw std::runtime_error("pads must be smaller than the kernel");  // otherwise a window may be empty
  return {out, [=](const Operands& operands, float* output) {
            for (std::int64_t y = 0; y < out.height; ++y)
              for (std::int64_t x = 0; x < out.width; ++x, output += in.channels) {
                std::fill_n(output, in.channels, -std::numeric_limits<float>::infinity());
                const std::int64_t first_row = y * window.down - window.top, first = x * window.across - window.left;
                for (std::int64_t row = std::max<std::int64_t>(0, first_row);
                     row < std::min(first_row + window.rows, in.height); ++row)
                  for (std::int64_t column = std::max<std::int64_t>(0, first);
                       column < std::min(first + window.columns, in.width); ++column) {
                    const float* pixel = operands[0] + (row * in.width + column) * in.channels;
                    for (std::int64_t c = 0; c < in.channels; ++c)  // NaN propagates
                      output[c] = pixel[c] > output[c] || pixel[c] != pixel[c] ? pixel[c] : output[c];
                  }
              }
          }};
}

Layer mean_pool(const OnnxNode&, const Inputs& inputs) {
  const Shape in = picture_of(inputs);
  return {{in.channels, 1, 1, false}, [in](const Operands& operands, float* output) {
            for (std::int64_t c = 0; c < in.channels; ++c) {
              double sum = 0;
              for (std::int64_t place = 0; place < in.height * in.width; ++place)
                sum += static_cast<double>(operands[0][place * in.channels + c]);
              output[c] = static_cast<float>(sum / static_cast<double>(in.height * in.width));
            }
          }};
}

// ONNX's element order is channels x height x width.
Layer flatten(const OnnxNode& node, const Inputs& inputs) {
  const Shape in = operand_of(inputs, 0);
  if (const std::int64_t axis = node.integer("axis", 1); axis != 1 && axis != (in.flat ? -1 : -3))
    throw std::runtime_error("axis '" + std::to_string(axis) + "' is not supported; must be 1");
  return {{in.channels * in.height * in.width, 1, 1, true}, [in](const Operands& operands, float* output) {
            const std::int64_t pixels = in.height * in.width;
            for (std::int64_t c = 0; c < in.channels; ++c)
              for (std::int64_t place = 0; place < pixels; ++place) *output++ = operands[0][place * in.channels + c];
          }};
}

template <class Function>
Layer each(const Inputs& inputs, Function function) {
  const Shape shape = operand_of(inputs, 0);
  return {shape, [function, count = shape.count()](const Operands& operands, float* output) {
            for (std::size_t i = 0; i < count; ++i) output[i] = function(operands[0][i]);
          }};
}

Layer same(const OnnxNode&, const Inputs& inputs) {
  return each(inputs, [](float x) { return x; });
}

Layer cast(const OnnxNode& node, const Inputs& inputs) {
  if (node.integer("to", 0) != 1) throw std::runtime_error("the target type of a cast must be float");
  return same(node, inputs);
}

Layer relu(const OnnxNode&, const Inputs& inputs) {
  return each(inputs, [](float x) { return x < 0 ? 0.0F : x; });
}

Layer leaky_relu(const OnnxNode& node, const Inputs& inputs) {
  return each(inputs, [alpha = node.number("alpha", 0.01F)](float x) { return x < 0 ? alpha * x : x; });
}

// exp(x) - 1; near 0 three terms of the series, exact to 5e-17, because the difference would cancel.
double exponential_less_one(double x) {
  return std::fabs(x) < 1e-4 ? x * (1 + x / 2 * (1 + x / 3)) : portable_exp(x) - 1;
}

Layer elu(const OnnxNode& node, const Inputs& inputs) {
  return each(inputs, [alpha = static_cast<double>(node.number("alpha", 1))](float x) {
    return x < 0 ? static_cast<float>(alpha * exponential_less_one(static_cast<double>(x))) : x;
  });
}

Layer tanh_layer(const OnnxNode&, const Inputs& inputs) {
  return each(inputs, [](float x) {
    const double change = exponential_less_one(-2 * std::fabs(static_cast<double>(x)));
    return std::copysign(static_cast<float>(-change / (2 + change)), x);
  });
}

Layer sigmoid(const OnnxNode&, const Inputs& inputs) {
  return each(inputs, [](float x) { return static_cast<float>(1 / (1 + portable_exp(-static_cast<double>(x)))); });
}

// A constant broadcast to `shape`, in the element order of Shape.
std::vector<float> spread(const OnnxTensor& constant, const Shape& shape) {
  const std::int64_t sides[4] = {1, shape.channels, shape.height, shape.width};
  const std::size_t rank = shape.flat ? 2 : 4, missing = rank - std::min(rank, constant.dims.size());
  std::int64_t steps[4] = {0, 0, 0, 0}, step = 1;
  for (std::size_t i = rank; i-- > missing;) {
    const std::int64_t dim = constant.dims[i - missing];
    if (constant.dims.size() > rank || (dim != 1 && dim != sides[i]))
      throw std::runtime_error("the shape of the constant does not match the other input");
    steps[i] = dim == 1 ? 0 : step;
    step *= dim;
  }
  if (constant.dims.size() > rank) throw std::runtime_error("the constant has more dimensions than the other input");
  std::vector<float> values;
  values.reserve(shape.count());
  for (std::int64_t y = 0; y < shape.height; ++y)
    for (std::int64_t x = 0; x < shape.width; ++x)
      for (std::int64_t c = 0; c < shape.channels; ++c)
        values.push_back(constant.values[static_cast<std::size_t>(c * steps[1] + y * steps[2] + x * steps[3])]);
  return values;
}

template <class Function>
Layer pair(const Inputs& inputs, Function function) {
  if (inputs.size() != 2) throw std::runtime_error("must have two inputs");
  const std::size_t place = inputs[0].operand ? 0 : 1;
  const Shape shape = operand_of(inputs, place), other = inputs[1].operand ? *inputs[1].operand : shape;
  if (shape.flat != other.flat || shape.channels != other.channels || shape.height != other.height ||
      shape.width != other.width)
    throw std::runtime_error("the inputs differ in shape");
  std::vector<float> constant;
  if (const OnnxTensor* tensor = inputs[1 - place].constant)
    constant = spread(*tensor, shape);
  else if (!inputs[1 - place].operand)
    throw std::runtime_error("must have two inputs");
  return {shape, [=, count = shape.count(), constant = std::move(constant)](const Operands& operands, float* output) {
            const bool known = !constant.empty();
            const float* one = known && place == 1 ? constant.data() : operands[0];
            const float* two = !known ? operands[1] : place == 1 ? operands[0] : constant.data();
            for (std::size_t i = 0; i < count; ++i) output[i] = function(one[i], two[i]);
          }};
}

Layer add(const OnnxNode&, const Inputs& inputs) {
  return pair(inputs, [](float a, float b) { return a + b; });
}
Layer subtract(const OnnxNode&, const Inputs& inputs) {
  return pair(inputs, [](float a, float b) { return a - b; });
}
Layer times(const OnnxNode&, const Inputs& inputs) {
  return pair(inputs, [](float a, float b) { return a * b; });
}
Layer divide(const OnnxNode&, const Inputs& inputs) {
  return pair(inputs, [](float a, float b) { return a / b; });
}

const std::map<std::string, MakeLayer>& layers() {
  static const std::map<std::string, MakeLayer> all = {{"Add", add},          {"Cast", cast},
                                                       {"Conv", convolution}, {"Div", divide},
                                                       {"Elu", elu},          {"Flatten", flatten},
                                                       {"Gemm", gemm},        {"GlobalAveragePool", mean_pool},
                                                       {"Identity", same},    {"LeakyRelu", leaky_relu},
                                                       {"MatMul", matmul},    {"MaxPool", max_pool},
                                                       {"Mul", times},        {"Relu", relu},
                                                       {"Sigmoid", sigmoid},  {"Sub", subtract},
                                                       {"Tanh", tanh_layer}};
  return all;
}

}  // namespace

MakeLayer layer_of(const std::string& op) {
  const auto found = layers().find(op);
  return found != layers().end() ? found->second : nullptr;
}

std::string layer_names() {
  std::string names;
  for (const auto& [name, make] : layers()) names += (names.empty() ? "" : ", ") + name;
  return names;
}

}  // namespace relign::policies
