// A trained network in an ONNX file, run by OpenCV's DNN module on one thread. The only file that knows OpenCV.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace relign::policies {

// One object, one thread at a time: OpenCV keeps the layers' outputs inside.
class Network {
 public:
  // `bytes`: the file's content. Throws std::runtime_error with OpenCV's reason when it is no network that can be read.
  explicit Network(const std::string& bytes);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  // `input`: frames x size x size bytes as float, the newest frame last. Returns the output's values.
  // Throws std::runtime_error when the network takes no such input.
  std::vector<float> answer(const std::vector<float>& input, int frames, int size);

 private:
  struct Net;
  std::unique_ptr<Net> net_;
};

}  // namespace relign::policies
