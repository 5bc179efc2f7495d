// The optional part opencv_network (relign/optional_part.hpp): the only file of this folder that includes OpenCV.
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <stdexcept>

#include "network.hpp"

namespace relign::policies {
namespace {

// OpenCV's messages have several lines, with locations in its own sources.
std::string reason(const cv::Exception& error) {
  const std::string text = error.err.empty() ? error.what() : error.err;
  return text.substr(0, text.find('\n'));
}

class OpenCvNetwork : public Network {
 public:
  OpenCvNetwork(const std::string& bytes, InputShape shape) : shape_(shape) {
    if (shape.history > 0)
      throw std::runtime_error(
          "a network with a history runs on portable operators only, \"reproducible\": \"anywhere\"");
    // One thread: workers share the processor. Errors are thrown, so OpenCV need not print them.
    cv::setNumThreads(1);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    try {
      net_ = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
      net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
      net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    } catch (const cv::Exception& error) {
      throw std::runtime_error("not an ONNX network that OpenCV can read (" + reason(error) + ")");
    }
    if (net_.empty()) throw std::runtime_error("not an ONNX network: it has no operators");
  }

  std::vector<float> answer(const std::vector<float>& input) override {
    const int rows = shape_.rows > 0 ? shape_.rows : shape_.size;
    const int shape[4] = {1, shape_.frames, rows, shape_.size};
    try {
      // OpenCV does not accept a pointer to const data, but does not write to it either.
      net_.setInput(cv::Mat(4, shape, CV_32F, const_cast<float*>(input.data())));
      const cv::Mat output = net_.forward();
      if (output.type() != CV_32F) throw std::runtime_error("the network's output must be of type float");
      const auto* values = output.ptr<float>();
      return {values, values + output.total()};
    } catch (const cv::Exception& error) {
      throw std::runtime_error("the network does not accept an input of 1 x " + std::to_string(shape_.frames) + " x " +
                               std::to_string(rows) + " x " + std::to_string(shape_.size) + " (" + reason(error) + ")");
    }
  }

 private:
  InputShape shape_;
  cv::dnn::Net net_;
};

}  // namespace
}  // namespace relign::policies

// Throws what the network's constructor throws; the caller owns the network.
extern "C" __attribute__((visibility("default"))) relign::policies::Network* relign_opencv_network(
    const std::string& bytes, const relign::policies::InputShape& shape) {
  return new relign::policies::OpenCvNetwork(bytes, shape);
}
