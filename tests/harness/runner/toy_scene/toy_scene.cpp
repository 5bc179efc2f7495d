// A fast scene: one lens element, two axes, a Gaussian spot.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

constexpr unsigned kWidth = 12;
constexpr unsigned kHeight = 8;

std::vector<float> spot(double x, double y) {
  std::vector<float> pixels(std::size_t{kWidth} * kHeight);
  for (unsigned row = 0; row < kHeight; ++row)
    for (unsigned column = 0; column < kWidth; ++column) {
      const double dx = (column + 0.5) / kWidth - x;
      const double dy = (row + 0.5) / kHeight - y;
      pixels[row * kWidth + column] = static_cast<float>(std::exp(-20 * (dx * dx + dy * dy)));
    }
  return pixels;
}

class ToyAssembly final : public relign::Assembly {
 public:
  ToyAssembly(double shift, double broken_above, double blind_above, bool tells_optimum, bool tells_mtf,
              const std::vector<float>& reference)
      : shift_(shift),
        broken_above_(broken_above),
        blind_above_(blind_above),
        tells_optimum_(tells_optimum),
        tells_mtf_(tells_mtf),
        reference_(reference) {}

  void capture(const relign::Pose& pose, std::uint64_t frame_seed, float* pixels) override {
    if (pose[0] > broken_above_) throw std::runtime_error("the camera fell off");
    relign::Random random(frame_seed);
    const std::vector<float> image = spot(pose[0] + shift_, pose[1]);
    for (std::size_t index = 0; index < image.size(); ++index)
      pixels[index] = image[index] + static_cast<float>(0.01 * random.normal());
  }
  Truth noise_free_mse(const relign::Pose& pose, std::uint64_t seed) override {
    if (pose[0] > blind_above_) throw std::runtime_error("nothing to see up there");
    const std::vector<float> image = spot(pose[0] + shift_, pose[1]);
    double sum = 0;
    for (std::size_t index = 0; index < image.size(); ++index) {
      const double difference = static_cast<double>(image[index]) - static_cast<double>(reference_[index]);
      sum += difference * difference;
    }
    return {sum / static_cast<double>(image.size()) + 1e-9 * relign::Random(seed).normal(), 1e-9};
  }
  bool render_noise_free(const relign::Pose& pose, float* pixels) override {
    if (pose[0] > broken_above_) throw std::runtime_error("the camera fell off");
    const std::vector<float> image = spot(pose[0] + shift_, pose[1]);
    std::copy(image.begin(), image.end(), pixels);
    return true;
  }
  std::optional<Optimum> own_optimum(std::uint64_t seed) override {
    if (!tells_optimum_) return std::nullopt;
    const relign::Pose pose = {0.5 - shift_, 0.5};
    const Truth there = noise_free_mse(pose, seed);
    return Optimum{pose, there.mse, there.standard_error};
  }
  std::optional<FieldMtf> mtf(const relign::Pose& pose, double lp_per_mm) override {
    if (!tells_mtf_) return std::nullopt;
    const double centre = 1 / (1 + lp_per_mm * std::fabs(pose[0] + shift_ - 0.5));
    return FieldMtf{centre, centre / (1 + lp_per_mm * std::fabs(pose[1] - 0.5))};
  }

 private:
  double shift_;
  double broken_above_, blind_above_;
  bool tells_optimum_, tells_mtf_;
  const std::vector<float>& reference_;
};

class ToyScene final : public relign::Scene {
 public:
  explicit ToyScene(const relign::Parameters& given)
      : broken_above_(given.number("broken_above")),
        blind_above_(given.number("blind_above")),
        tells_optimum_(given.boolean("tells_optimum")),
        tells_mtf_(given.boolean("tells_mtf")),
        reference_(spot(0.5, 0.5)) {}

  std::string describe() override {
    return R"({"name": "toy", "summary": "A spot.", "nominal_pose": [0.5, 0.5],
      "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, {"name": "y", "unit": "mm", "lower": -1, "upper": 1}],
      "image": {"width": 12, "height": 8, "white": 1}, "elements": ["L1"], "files": []})";
  }
  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    image.sample_format = RELIGN_SAMPLE_FLOAT32;
    image.width = kWidth;
    image.height = kHeight;
    image.channels = 1;
    image.pixels = reference_.data();
    image.row_stride_bytes = kWidth * sizeof(float);
    return image;
  }
  std::unique_ptr<relign::Assembly> mount(std::string_view offsets) override {
    const auto json = nlohmann::json::parse(offsets);
    const double shift = json.contains("L1") ? json["L1"]["shift_mm"][0].get<double>() : 0.0;
    return std::make_unique<ToyAssembly>(shift, broken_above_, blind_above_, tells_optimum_, tells_mtf_, reference_);
  }

 private:
  double broken_above_, blind_above_;
  bool tells_optimum_, tells_mtf_;
  std::vector<float> reference_;
};

}  // namespace

RELIGN_PLUGIN(ToyScene)
