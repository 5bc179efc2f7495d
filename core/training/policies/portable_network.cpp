#include <algorithm>
#include <stdexcept>

#include "layers.hpp"
#include "network.hpp"
#include "onnx_file.hpp"

namespace relign::policies {
namespace {

constexpr std::int64_t kFirstOpset = 7;  // earlier versions broadcast operands by attributes
constexpr std::size_t kMaxNumbers = std::size_t{64} << 20;

// Appended where a valid network uses an unsupported feature.
constexpr const char* kOtherwise =
    "; set \"reproducible\": \"this_cpu\" in the network's side file to run it with OpenCV, whose last digits depend "
    "on the processor";

std::string named(const OnnxNode& node) {
  return "operator " + node.op + (node.name.empty() ? "" : " (" + node.name + ")");
}

class PortableNetwork : public Network {
 public:
  PortableNetwork(OnnxGraph graph, InputShape input) {
    if (graph.opset < kFirstOpset)
      throw std::runtime_error("ONNX operator set '" + std::to_string(graph.opset) + "' is not supported; must be " +
                               std::to_string(kFirstOpset) + " or later");
    const std::int64_t rows = input.rows > 0 ? input.rows : input.size;
    if (input.frames > 0) take(graph, {1, input.frames, rows, input.size}, {input.frames, rows, input.size, false});
    if (input.history > 0) take(graph, {1, input.history}, {input.history, 1, 1, true});
    if (graph.inputs.size() != values_.size())
      throw std::runtime_error("the network has " + std::to_string(graph.inputs.size()) +
                               " inputs, its side file describes " + std::to_string(values_.size()));
    inputs_ = values_.size();
    for (OnnxNode& node : graph.nodes) add(node, graph.constants);
    const auto output = places_.find(graph.output);
    if (output == places_.end()) throw std::runtime_error("no operator computes the output '" + graph.output + "'");
    output_ = output->second;
    if (const Shape& shape = values_[output_].shape;
        !shape.flat && shape.channels > 1 && shape.height * shape.width > 1)
      throw std::runtime_error("the output '" + graph.output + "' is an image; must be one value per axis");
  }

  std::vector<float> answer(const std::vector<float>& input) override {
    std::size_t needed = 0;
    for (std::size_t place = 0; place < inputs_; ++place) needed += values_[place].numbers.size();
    if (input.size() != needed)
      throw std::runtime_error("the network's input has " + std::to_string(input.size()) + " values; must have " +
                               std::to_string(needed));
    const float* from = input.data();
    for (std::size_t place = 0; place < inputs_; ++place) {
      // From frames x rows x columns to rows x columns x frames; a history is one frame of one row.
      Value& value = values_[place];
      const std::size_t frames = value.shape.flat ? 1 : static_cast<std::size_t>(value.shape.channels);
      const std::size_t pixels = value.numbers.size() / frames;
      for (std::size_t frame = 0; frame < frames; ++frame)
        for (std::size_t pixel = 0; pixel < pixels; ++pixel) value.numbers[pixel * frames + frame] = *from++;
    }
    std::vector<const float*> inputs;
    for (const Step& step : steps_) {
      inputs.clear();
      for (const std::size_t place : step.inputs) inputs.push_back(values_[place].numbers.data());
      step.run(inputs, values_[step.output].numbers.data());
    }
    return values_[output_].numbers;
  }

 private:
  struct Value {
    Shape shape;
    std::vector<float> numbers;
  };
  struct Step {
    Run run;
    std::vector<std::size_t> inputs;  // indices into values_; constants are not listed
    std::size_t output;
  };

  // The network's own input of this shape becomes a value.
  void take(const OnnxGraph& graph, const std::vector<std::int64_t>& dims, const Shape& shape) {
    for (const OnnxGraph::Input& input : graph.inputs) {
      const bool fits = input.dims.size() == dims.size() &&
                        std::equal(dims.begin(), dims.end(), input.dims.begin(),
                                   [](std::int64_t given, std::int64_t own) { return own == 0 || own == given; });
      if (!fits) continue;
      places_[input.name] = values_.size();
      values_.push_back({shape, std::vector<float>(shape.count())});
      return;
    }
    std::string text;
    for (const std::int64_t dim : dims) text += (text.empty() ? "" : " x ") + std::to_string(dim);
    throw std::runtime_error("the network does not accept an input of " + text);
  }

  void add(OnnxNode& node, std::map<std::string, OnnxTensor>& constants) {
    if (node.outputs.empty()) throw std::runtime_error(named(node) + " has no output");
    if (node.op == "Constant") {  // a type other than float is refused where it is used
      if (const auto value = node.tensors.find("value"); value != node.tensors.end())
        constants[node.outputs[0]] = std::move(value->second);
      return;
    }
    const MakeLayer make = layer_of(node.op);
    if (!make)
      throw std::runtime_error(named(node) + " is not one of the portable operators (" + portable_operators() + ")" +
                               kOtherwise);
    try {
      Step step;
      std::vector<LayerInput> inputs;
      for (const std::string& name : node.inputs) {
        LayerInput input;
        if (const auto constant = constants.find(name); constant != constants.end()) {
          input.constant = &constant->second;
        } else if (const auto place = places_.find(name); place != places_.end()) {
          input.operand = &values_[place->second].shape;
          step.inputs.push_back(place->second);
        } else if (!name.empty()) {
          throw std::runtime_error("input '" + name +
                                   "' is not computed by an earlier operator, or is not of type float");
        }
        inputs.push_back(input);
      }
      Layer layer = make(node, inputs);
      numbers_ += layer.shape.count();
      if (numbers_ > kMaxNumbers) throw std::runtime_error("the network has more than 64 Mi intermediate values");
      step.run = std::move(layer.run);
      step.output = values_.size();
      steps_.push_back(std::move(step));
      places_[node.outputs[0]] = values_.size();
      values_.push_back({layer.shape, std::vector<float>(layer.shape.count())});
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(named(node) + ": " + error.what() + kOtherwise);
    }
  }

  std::vector<Value> values_;
  std::map<std::string, std::size_t> places_;  // indices into values_, by name
  std::vector<Step> steps_;
  std::size_t inputs_ = 0, output_ = 0, numbers_ = 0;
};

}  // namespace

std::unique_ptr<Network> portable_network(const std::string& bytes, InputShape shape) {
  return std::make_unique<PortableNetwork>(read_onnx(bytes), shape);
}

std::string portable_operators() { return "Constant, " + layer_names(); }

}  // namespace relign::policies
