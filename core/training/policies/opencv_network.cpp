// OpenCV's DNN module is large, and few networks need it: it is opened with the first of them.
#include <stdexcept>

#include "network.hpp"
#include "relign/optional_part.hpp"

namespace relign::policies {

std::unique_ptr<Network> opencv_network(const std::string& bytes, InputShape shape) {
  using Make = Network*(const std::string& bytes, const InputShape& shape);
  static Make* make = nullptr;
  if (!make) try {
      make = function_of_part<Make>("opencv_network", "relign_opencv_network");
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(std::string("this network needs OpenCV's dnn module: ") + error.what());
    }
  return std::unique_ptr<Network>(make(bytes, shape));
}

}  // namespace relign::policies
