#include "new_side_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/random.hpp>
#include <stdexcept>

#include "network.hpp"
#include "onnx_file.hpp"
#include "picture.hpp"
#include "side_file.hpp"

namespace relign::policies {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kParityInputs = 64, kPixelsOfParity = 10 * 10;
constexpr int kReferenceBlocks = 20;
constexpr double kByteWhites = 3;  // as relign-train: bytes reach three times the brightness of a lit pixel
constexpr std::int64_t kSmallest = 10, kLargest = 1024, kMostFrames = 64;

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

InputShape input_of(const OnnxGraph& graph, const ImageView& captured) {
  if (graph.inputs.size() != 1)
    throw std::runtime_error(
        "the network has two inputs; allowed: one, images; relign-train writes the side file of "
        "a network with a history");
  const std::vector<std::int64_t>& dims = graph.inputs[0].dims;
  std::string found;
  for (const std::int64_t dim : dims) found += (found.empty() ? "" : " x ") + (dim == 0 ? "?" : std::to_string(dim));
  const std::string what =
      "the network's input '" + graph.inputs[0].name + "' is " + (found.empty() ? "a scalar" : found);
  const bool fits = dims.size() == 4 && (dims[0] == 0 || dims[0] == 1) && dims[1] >= 1 && dims[1] <= kMostFrames &&
                    dims[2] == dims[3] && dims[2] >= kSmallest && dims[2] <= kLargest;
  if (!fits)
    throw std::runtime_error(what +
                             "; allowed: 1 x frames x size x size, with 1 to 64 frames and a size of 10 to 1024, " +
                             "all of them fixed when the network is exported");
  const auto size = static_cast<std::size_t>(dims[2]);
  if (captured.width() != captured.height() || captured.width() % size != 0)
    throw std::runtime_error(what + ", and captures of " + std::to_string(captured.width()) + " x " +
                             std::to_string(captured.height()) +
                             " pixels cannot be binned to that; allowed: a size that divides that of the captures");
  return {static_cast<int>(dims[1]), static_cast<int>(dims[2])};
}

// Its advice is to edit a side file, of which there is none yet.
std::unique_ptr<Network> network_of(const std::string& bytes, InputShape shape) {
  try {
    return portable_network(bytes, shape);
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    const std::size_t advice = text.find("; set \"reproducible\"");
    if (advice == std::string::npos) throw;
    throw std::runtime_error(text.substr(0, advice) + "; export a network without it");
  }
}

Json numbers(const std::vector<float>& values) {
  Json list = Json::array();
  for (const float value : values) list.push_back(static_cast<double>(value));
  return list;
}

Json parity_of(Network& network, const SideFile& side, const TargetScene& scene) {
  Json inputs = Json::array(), answers = Json::array();
  Random random(1);
  for (int i = 0; i < kParityInputs; ++i) {
    SideFile::Parity parity;
    std::string digits;
    for (int pixel = 0; pixel < side.frames * kPixelsOfParity; ++pixel) {
      parity.bytes.push_back(static_cast<std::uint8_t>(random.bits() >> 24U));
      digits += "0123456789abcdef"[parity.bytes.back() >> 4U];
      digits += "0123456789abcdef"[parity.bytes.back() & 15U];
    }
    parity.answer = network.answer(side.shown(parity));
    if (parity.answer.size() != scene.axes.size())
      throw std::runtime_error("the network returns " + std::to_string(parity.answer.size()) +
                               " values; allowed: one for each of the " + std::to_string(scene.axes.size()) +
                               " axes of scene '" + scene.id + "' (" + joined(scene.axes) + ")");
    for (const float value : parity.answer)
      if (!std::isfinite(value))
        throw std::runtime_error("the network returns values that are not finite for bytes 0 to 255");
    inputs.push_back(std::move(digits));
    answers.push_back(numbers(parity.answer));
  }
  return {{"inputs", std::move(inputs)}, {"answers", std::move(answers)}};
}

}  // namespace

std::string new_side_file(const std::string& bytes, const std::string& weights_sha256, const TargetScene& scene,
                          const std::string& command) {
  const InputShape shape = input_of(read_onnx(bytes), scene.reference);
  SideFile side;
  side.frames = shape.frames;
  side.size = shape.size;
  const std::unique_ptr<Network> network = network_of(bytes, shape);
  const Json about = {
      {"use", "network"},
      {"format", 1},
      {"scene", scene.id},
      {"axes", scene.axes},
      {"observation",
       {{"size", shape.size},
        {"frames", shape.frames},
        {"captured", {scene.reference.height(), scene.reference.width()}},
        {"white", scene.white},
        {"byte_whites", kByteWhites},
        {"mean", 0.0},
        {"deviation", 1.0}}},
      {"output", "way"},
      {"scales", std::vector<double>(scene.axes.size(), 1.0)},
      {"command", command},
      {"weights_sha256", weights_sha256},
      {"reference", {{"blocks", kReferenceBlocks}, {"means", numbers(resampled(scene.reference, kReferenceBlocks))}}},
      {"parity", parity_of(*network, side, scene)}};
  // One line per key, so that the keys to fill in can be found beside thousands of numbers.
  std::string text;
  for (const auto& [key, value] : about.items())
    text += (text.empty() ? "{\n " : ",\n ") + Json(key).dump() + ": " + value.dump();
  return text + "\n}\n";
}

}  // namespace relign::policies
