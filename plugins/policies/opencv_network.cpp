// The only file that includes OpenCV.
#include <stdexcept>

#include "network.hpp"

#if RELIGN_HAS_OPENCV_DNN
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>

namespace relign::policies {
namespace {

// OpenCV's messages have several lines, with its own source places.
std::string reason(const cv::Exception& error) {
  const std::string text = error.err.empty() ? error.what() : error.err;
  return text.substr(0, text.find('\n'));
}

class OpenCvNetwork : public Network {
 public:
  OpenCvNetwork(const std::string& bytes, InputShape shape) : shape_(shape) {
    // One thread: workers share the processor. Errors are thrown; they need not be printed, too.
    cv::setNumThreads(1);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    try {
      net_ = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
      net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
      net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    } catch (const cv::Exception& error) {
      throw std::runtime_error("no ONNX network that OpenCV can read (" + reason(error) + ")");
    }
    if (net_.empty()) throw std::runtime_error("no ONNX network: it has no layers");
  }

  std::vector<float> answer(const std::vector<float>& input) override {
    const int shape[4] = {1, shape_.frames, shape_.size, shape_.size};
    try {
      // OpenCV takes no pointer to constant data, and does not write to it.
      net_.setInput(cv::Mat(4, shape, CV_32F, const_cast<float*>(input.data())));
      const cv::Mat output = net_.forward();
      if (output.type() != CV_32F) throw std::runtime_error("the network's output is not of type float");
      const auto* values = output.ptr<float>();
      return {values, values + output.total()};
    } catch (const cv::Exception& error) {
      throw std::runtime_error("the network takes no input of 1 x " + std::to_string(shape_.frames) + " x " +
                               std::to_string(shape_.size) + " x " + std::to_string(shape_.size) + " (" +
                               reason(error) + ")");
    }
  }

 private:
  InputShape shape_;
  cv::dnn::Net net_;
};

}  // namespace

std::unique_ptr<Network> opencv_network(const std::string& bytes, InputShape shape) {
  return std::make_unique<OpenCvNetwork>(bytes, shape);
}

}  // namespace relign::policies
#else
namespace relign::policies {

std::unique_ptr<Network> opencv_network(const std::string&, InputShape) {
  throw std::runtime_error("this program was built without OpenCV's module dnn, which is to run it");
}

}  // namespace relign::policies
#endif
