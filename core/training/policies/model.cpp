#include "model.hpp"

#include <openssl/evp.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <stdexcept>

namespace relign::policies {
namespace {

constexpr double kParityTolerance = 1e-4;
constexpr std::uintmax_t kMaxNetworkBytes = 256u << 20;

std::string read_whole(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw std::runtime_error(path + ": cannot be read: " + error.message());
  if (size > kMaxNetworkBytes) throw std::runtime_error(path + ": larger than 256 MiB, the limit for a network");
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return bytes;
}

std::string sha256(const std::string& bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &length, EVP_sha256(), nullptr) != 1)
    throw std::runtime_error("SHA-256 is not available");
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += "0123456789abcdef"[digest[i] >> 4];
    text += "0123456789abcdef"[digest[i] & 15];
  }
  return text;
}

std::vector<double> checked_answer(Network& network, const SideFile& about, const std::vector<float>& images) {
  const std::vector<float> values = network.answer(images);
  if (values.size() != about.outputs())
    throw std::runtime_error("the network returns " + std::to_string(values.size()) + " values, its side file has " +
                             std::to_string(about.axes.size()) + " axes" +
                             (about.doubt ? " and 'doubt', which need twice as many values" : ""));
  for (const float value : values)
    if (!std::isfinite(value))
      throw std::runtime_error("the network returns values that are not finite: its weights are damaged");
  return {values.begin(), values.end()};
}

std::unique_ptr<Network> network_of(const std::string& bytes, const SideFile& about) {
  return about.portable ? portable_network(bytes, about.shape()) : opencv_network(bytes, about.shape());
}

void check_parity(Network& network, const SideFile& about) {
  for (const SideFile::Parity& parity : about.parity) {
    const std::vector<double> values = checked_answer(network, about, about.shown(parity));
    for (std::size_t k = 0; k < values.size(); ++k)
      if (!(std::fabs(values[k] - static_cast<double>(parity.answer[k])) <= kParityTolerance))
        throw std::runtime_error("the network returns " + std::to_string(values[k]) + " on axis '" +
                                 about.axes[k % about.axes.size()] + "' for a parity input, its side file has " +
                                 std::to_string(parity.answer[k]) + "; the files do not belong together");
  }
}

}  // namespace

struct Model::Kept {
  // Throws what Model's constructor throws.
  Kept(const std::string& onnx_path, const std::string& side_path, const std::string& hash, std::string content)
      : bytes(std::move(content)), about(read_side_file(side_path)) {
    if (about.weights_sha256 != hash)
      throw std::runtime_error(onnx_path + ": SHA-256 '" + hash + "' differs from '" + about.weights_sha256 + "' in " +
                               side_path + "; the network is damaged or belongs to another side file");
    try {
      auto network = network_of(bytes, about);
      check_parity(*network, about);
      idle.push_back(std::move(network));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(onnx_path + ": " + error.what());
    }
  }

  std::string bytes;
  SideFile about;
  std::mutex mutex;
  std::vector<std::unique_ptr<Network>> idle;
};

Model::Model(const std::string& onnx_path) {
  const std::string side_path = std::filesystem::path(onnx_path).replace_extension(".json").string();
  // Keyed by content, so that a replaced file is loaded again.
  std::string bytes = read_whole(onnx_path);
  const std::string hash = sha256(bytes);
  std::error_code ignored;
  const auto written = std::filesystem::last_write_time(side_path, ignored).time_since_epoch().count();
  const std::string key = hash + side_path + std::to_string(written);

  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<Kept>> models;
  {
    const std::lock_guard<std::mutex> hold(mutex);
    const auto found = models.find(key);
    kept_ =
        found != models.end() ? found->second : std::make_shared<Kept>(onnx_path, side_path, hash, std::move(bytes));
    models[key] = kept_;
  }
  const std::lock_guard<std::mutex> borrow(kept_->mutex);
  if (kept_->idle.empty()) {
    network_ = network_of(kept_->bytes, kept_->about);
  } else {
    network_ = std::move(kept_->idle.back());
    kept_->idle.pop_back();
  }
}

Model::~Model() {
  const std::lock_guard<std::mutex> hold(kept_->mutex);
  kept_->idle.push_back(std::move(network_));
}

const SideFile& Model::about() const { return kept_->about; }

std::vector<double> Model::answer(const std::vector<float>& images) {
  const SideFile& side = kept_->about;
  if (side.mean == 0 && side.deviation == 1 && side.scales.empty()) return checked_answer(*network_, side, images);
  std::vector<float> normalised(images.size());
  for (std::size_t i = 0; i < images.size(); ++i)
    normalised[i] = static_cast<float>((static_cast<double>(images[i]) - side.mean) / side.deviation);
  std::vector<double> answer = checked_answer(*network_, side, normalised);
  for (std::size_t axis = 0; axis < side.scales.size(); ++axis) answer[axis] *= side.scales[axis];
  return answer;
}

}  // namespace relign::policies
