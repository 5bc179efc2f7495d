#include "network.hpp"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <stdexcept>

namespace relign::policies {

struct Network::Net {
  cv::dnn::Net net;
};

namespace {

// OpenCV's messages have several lines, with its own source places.
std::string reason(const cv::Exception& error) {
  const std::string text = error.err.empty() ? error.what() : error.err;
  return text.substr(0, text.find('\n'));
}

}  // namespace

Network::Network(const std::string& bytes) : net_(std::make_unique<Net>()) {
  // One thread: workers share the processor. Errors are thrown; they need not be printed, too.
  cv::setNumThreads(1);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  try {
    net_->net = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
    net_->net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net_->net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  } catch (const cv::Exception& error) {
    throw std::runtime_error("no ONNX network that OpenCV can read (" + reason(error) + ")");
  }
  if (net_->net.empty()) throw std::runtime_error("no ONNX network: it has no layers");
}

Network::~Network() = default;

std::vector<float> Network::answer(const std::vector<float>& input, int frames, int size) {
  const int shape[4] = {1, frames, size, size};
  try {
    // OpenCV takes no pointer to constant data, and does not write to it.
    net_->net.setInput(cv::Mat(4, shape, CV_32F, const_cast<float*>(input.data())));
    const cv::Mat output = net_->net.forward();
    if (output.type() != CV_32F) throw std::runtime_error("the network's output is not of type float");
    const auto* values = output.ptr<float>();
    return {values, values + output.total()};
  } catch (const cv::Exception& error) {
    throw std::runtime_error("the network takes no input of 1 x " + std::to_string(frames) + " x " +
                             std::to_string(size) + " x " + std::to_string(size) + " (" + reason(error) + ")");
  }
}

}  // namespace relign::policies
