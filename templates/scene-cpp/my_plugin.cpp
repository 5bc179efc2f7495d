// A synthetic scene: a point source seen through a lens of two elements, as a round spot that is small in focus.
//
// A scene turns (assembly, true pose, frame seed) into an image. Images and truths are pure functions of
// their arguments: equal arguments, equal bits, whatever was asked before.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kPixels = 64;            // a side
constexpr double kPitchMm = 0.005;               // from pixel to pixel
constexpr double kTravelMm[] = {0.1, 0.1, 0.2};  // x, y, z: half of the travel
constexpr double kSharpMm = 0.010;               // radius of the spot in focus
constexpr double kBlurPerMm = 0.2;               // growth of the radius out of focus
constexpr double kSpotPerDegree = 0.02;          // mm that the spot moves when an element tilts

struct Offsets {
  double shift_mm[3] = {0, 0, 0};
};

// What an image depends on: where the spot is and how large.
std::vector<float> render(const relign::Pose& true_pose, const Offsets& offsets) {
  double place_mm[3];  // true pose 0..1 to mm, 0 is the middle of the travel
  for (int axis = 0; axis < 3; ++axis)
    place_mm[axis] = (2 * true_pose[static_cast<std::size_t>(axis)] - 1) * kTravelMm[axis] + offsets.shift_mm[axis];
  const double radius = std::hypot(kSharpMm, kBlurPerMm * place_mm[2]);
  const double peak = kSharpMm * kSharpMm / (radius * radius);  // the same light on a larger spot
  std::vector<float> pixels(std::size_t{kPixels} * kPixels);
  for (std::uint32_t y = 0; y < kPixels; ++y)
    for (std::uint32_t x = 0; x < kPixels; ++x) {
      const double dx = (x - 0.5 * (kPixels - 1)) * kPitchMm - place_mm[0];
      const double dy = (y - 0.5 * (kPixels - 1)) * kPitchMm - place_mm[1];
      pixels[std::size_t{y} * kPixels + x] =
          static_cast<float>(peak * std::exp(-(dx * dx + dy * dy) / (2 * radius * radius)));
    }
  return pixels;
}

class Spot final : public relign::Assembly {
 public:
  Spot(const Offsets& offsets, double read_noise, const std::vector<float>& reference)
      : offsets_(offsets), read_noise_(read_noise), reference_(reference) {}

  void capture(const relign::Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
    const std::vector<float> clean = render(true_pose, offsets_);
    relign::Random random(frame_seed);
    for (std::size_t i = 0; i < clean.size(); ++i)
      pixels[i] = clean[i] + static_cast<float>(read_noise_ * random.normal());
  }

  // The model is exact, so one render has no error and the seed is not needed. A scene that samples would
  // multiply the differences of two independent renders to two independent references: their noise then
  // averages out instead of adding to the error, and the standard error is its precision.
  Truth noise_free_mse(const relign::Pose& true_pose, std::uint64_t /*seed*/) override {
    const std::vector<float> clean = render(true_pose, offsets_);
    double sum = 0;
    for (std::size_t i = 0; i < clean.size(); ++i) {
      const double difference = double{clean[i]} - reference_[i];
      sum += difference * difference;
    }
    return {sum / static_cast<double>(clean.size()), 0.0};
  }

  bool render_noise_free(const relign::Pose& true_pose, float* pixels) override {
    const std::vector<float> clean = render(true_pose, offsets_);
    std::copy(clean.begin(), clean.end(), pixels);
    return true;
  }

 private:
  Offsets offsets_;
  double read_noise_;
  const std::vector<float>& reference_;
};

class MyPlugin final : public relign::Scene {
 public:
  explicit MyPlugin(const relign::Parameters& given)
      : read_noise_(given.number("read_noise")), reference_(render(nominal_pose(), Offsets())) {}

  std::string describe() override {
    Json axes = Json::array();
    for (const std::size_t axis : {0, 1, 2})
      axes.push_back({{"name", std::string(1, "xyz"[axis])},
                      {"unit", "mm"},
                      {"lower", -kTravelMm[axis]},
                      {"upper", kTravelMm[axis]}});
    const Json description = {{"name", "my_plugin"},
                              {"summary", "A point source as a round spot"},
                              {"axes", axes},
                              {"nominal_pose", nominal_pose()},
                              {"image", {{"width", kPixels}, {"height", kPixels}, {"white", 1.0}}},
                              {"elements", {"L1", "L2"}}};
    return description.dump();
  }

  // O*: what the perfect lens shows at the nominal pose, without noise.
  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    image.sample_format = RELIGN_SAMPLE_FLOAT32;
    image.width = image.height = kPixels;
    image.channels = 1;
    image.pixels = reference_.data();
    image.row_stride_bytes = kPixels * sizeof(float);
    return image;
  }

  // One lens as assembled: {"L1": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}, ...}; {} is the perfect lens.
  std::unique_ptr<relign::Assembly> mount(std::string_view offsets_json) override {
    Offsets total;
    const Json elements = Json::parse(offsets_json);
    for (const auto& [element, offsets] : elements.items()) {
      if (element != "L1" && element != "L2") throw std::invalid_argument("there is no element '" + element + "'");
      const std::vector<double> shift_mm = offsets.value("shift_mm", std::vector<double>(3, 0.0));
      const std::vector<double> tilt_deg = offsets.value("tilt_deg", std::vector<double>(2, 0.0));
      for (const std::size_t axis : {0, 1, 2}) total.shift_mm[axis] += shift_mm.at(axis);
      total.shift_mm[0] += kSpotPerDegree * tilt_deg.at(1);
      total.shift_mm[1] -= kSpotPerDegree * tilt_deg.at(0);
    }
    return std::make_unique<Spot>(total, read_noise_, reference_);
  }

 private:
  static relign::Pose nominal_pose() { return {0.5, 0.5, 0.5}; }

  double read_noise_;
  std::vector<float> reference_;
};

}  // namespace

RELIGN_PLUGIN(MyPlugin)
