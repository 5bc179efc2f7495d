// A scene whose captures cost nothing, for measuring the overhead of the harness.
#include <relign/plugin.hpp>

namespace {

constexpr std::uint32_t kSide = 4;

class NullAssembly final : public relign::Assembly {
 public:
  void capture(const relign::Pose& true_pose, std::uint64_t, float* pixels) override {
    pixels[0] = static_cast<float>(true_pose[0]);
  }
  Truth noise_free_mse(const relign::Pose&, std::uint64_t) override { return {0, 0}; }
};

class NullScene final : public relign::Scene {
 public:
  explicit NullScene(const relign::Parameters& given)
      : truth_(given.boolean("truth")), reference_(std::size_t{kSide} * kSide) {}

  std::string describe() override {
    std::string axes;
    for (const char* name : {"x", "y", "z", "Rx", "Ry"})
      axes += std::string(axes.empty() ? "" : ",") + R"({"name": ")" + name +
              R"(", "unit": "mm", "lower": -1, "upper": 1})";
    return R"({"name": "null scene", "axes": [)" + axes +
           R"(], "nominal_pose": [0.5, 0.5, 0.5, 0.5, 0.5], "elements": [],
               "image": {"width": 4, "height": 4, "white": 1}, "truth": )" +
           (truth_ ? "true}" : "false}");
  }
  relign_image reference() override {
    return {sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, reference_.data(), kSide * sizeof(float)};
  }
  std::unique_ptr<relign::Assembly> mount(std::string_view) override { return std::make_unique<NullAssembly>(); }

 private:
  bool truth_;
  std::vector<float> reference_;
};

}  // namespace

RELIGN_PLUGIN(NullScene)
