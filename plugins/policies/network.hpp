// A trained network in an ONNX file.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace relign::policies {

// One object, one thread at a time: the layers' outputs are kept inside.
class Network {
 public:
  Network() = default;
  virtual ~Network() = default;
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  // `input`: frames x size x size bytes as float, the newest frame last. Returns the output's values.
  virtual std::vector<float> answer(const std::vector<float>& input) = 0;
};

// The input of a network: 1 x frames x size x size.
struct InputShape {
  int frames = 1;
  int size = 0;
};

// Runs the network by this program's own operators: the same bits on every processor (dense_kernel.hpp).
// `bytes`: the file's content. Throws std::runtime_error where it is no ONNX network, takes no such input, or has an
// operator that is not among portable_operators().
std::unique_ptr<Network> portable_network(const std::string& bytes, InputShape shape);
// Their names, separated by ", ".
std::string portable_operators();

// Runs the network by OpenCV's DNN module on one thread, with the instructions that OpenCV chooses for this processor:
// the last bits differ between processors. Throws std::runtime_error with OpenCV's reason where it cannot read it, or
// where this program was built without the module.
std::unique_ptr<Network> opencv_network(const std::string& bytes, InputShape shape);

}  // namespace relign::policies
