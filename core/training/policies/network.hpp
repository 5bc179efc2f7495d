// Inference of a trained network from an ONNX file.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace relign::policies {

// Not thread-safe: the object holds the layers' output buffers.
class Network {
 public:
  Network() = default;
  virtual ~Network() = default;
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  // input: frames x rows x size bytes as float or irradiances, the newest frame last, then the history. Returns the
  // values of the output.
  virtual std::vector<float> answer(const std::vector<float>& input) = 0;
};

// Shape of a network's inputs: images of 1 x frames x rows x size, and a history of 1 x history; each may be absent.
struct InputShape {
  int frames = 1;  // 0: no images
  int size = 0;
  int rows = 0;     // 0: as many as columns
  int history = 0;  // 0: none
};

// Runs the network with this library's own operators, which give the same bits on every processor (dense_kernel.hpp).
// bytes: the content of the ONNX file. Throws std::runtime_error if it is not an ONNX network, if it does not accept an
// inputs of this shape, or if it has an operator that is not one of portable_operators().
std::unique_ptr<Network> portable_network(const std::string& bytes, InputShape shape);
// Names of the supported operators, separated by ", ".
std::string portable_operators();

// Runs the network with OpenCV's DNN module on one thread. OpenCV selects instructions by processor, so the last bits
// differ between processors. Throws std::runtime_error with OpenCV's reason if it cannot read the network, if this
// installation lacks the module, or if the shape has a history.
std::unique_ptr<Network> opencv_network(const std::string& bytes, InputShape shape);

}  // namespace relign::policies
