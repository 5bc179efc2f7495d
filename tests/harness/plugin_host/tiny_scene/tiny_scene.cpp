// For tests: a minimal scene; every pixel is the sum of pose and frame seed.
#include <cmath>
#include <relign/plugin.hpp>

namespace {

constexpr std::uint32_t kWidth = 4;
constexpr std::uint32_t kHeight = 3;

class TinyAssembly final : public relign::Assembly {
 public:
  explicit TinyAssembly(std::string broken) : broken_(std::move(broken)) {}
  void capture(const relign::Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
    if (broken_ == "capture") throw std::runtime_error("the shutter is stuck");
    double sum = static_cast<double>(frame_seed);
    for (const double value : true_pose) sum += value;
    std::fill(pixels, pixels + kWidth * kHeight, static_cast<float>(sum));
  }
  Truth noise_free_mse(const relign::Pose& true_pose, std::uint64_t) override {
    if (broken_ == "truth") return {std::nan(""), 0};
    return {true_pose.at(0), 0.5};
  }
  bool render_noise_free(const relign::Pose&, float* pixels) override {
    if (broken_ == "no picture") return false;
    std::fill(pixels, pixels + kWidth * kHeight, 0.5f);
    return true;
  }
  std::optional<Average> render_average(const relign::Pose&, std::uint64_t seed, double error, std::uint64_t samples,
                                        float* pixels) override {
    if (broken_ == "no picture") return std::nullopt;
    std::fill(pixels, pixels + kWidth * kHeight, static_cast<float>(seed + samples));
    return Average{broken_ == "average" ? -1 : error, samples};
  }

 private:
  std::string broken_;
};

class TinyScene final : public relign::Scene {
 public:
  explicit TinyScene(const relign::Parameters& given)
      : broken_(given.text("broken")), pixels_(kWidth * kHeight, 1.0f) {}
  std::string describe() override { return R"({"name": "tiny"})"; }
  relign_image reference() override {
    return {sizeof(relign_image),
            RELIGN_SAMPLE_FLOAT32,
            kWidth,
            kHeight,
            1,
            0,
            broken_ == "reference" ? nullptr : pixels_.data(),
            kWidth * sizeof(float)};
  }
  std::unique_ptr<relign::Assembly> mount(std::string_view offsets) override {
    if (broken_ == "mount" || offsets != "{}") throw std::runtime_error("cannot mount " + std::string(offsets));
    return std::make_unique<TinyAssembly>(broken_);
  }

 private:
  std::string broken_;
  std::vector<float> pixels_;
};

}  // namespace

RELIGN_PLUGIN(TinyScene)
