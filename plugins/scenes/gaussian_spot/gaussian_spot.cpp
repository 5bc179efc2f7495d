// gaussian_spot: a toy scene, a Gaussian density instead of a lens. See README.md.
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kPixels = 50;       // a side of the square from -1 to 1 mm
constexpr double kPitchMm = 2.0 / kPixels;  // from pixel to pixel
constexpr double kTwoPi = 6.283185307179586;
constexpr double kPeakAtNominal = 1.591549430;  // 1 / (2 pi 0.1)

relign::Pose nominal_pose() { return {0.5, 0.5, 0.5, 0.5, 0.5}; }

// The density at the pixels' centres, per square millimetre. Uses no function of the C library except the square root,
// which is correctly rounded, so pixels are the same on every machine.
std::vector<float> render(const relign::Pose& true_pose) {
  const double x_mm = 2 * true_pose[0] - 1, y_mm = 2 * true_pose[1] - 1;
  const double along = 0.05 + true_pose[2] * true_pose[2] / 5;  // perturbations along the spot's principal axes, mm^2
  const double across = 0.05 + true_pose[3] * true_pose[3] / 5;
  const relign::SineCosine angle = relign::portable_sine_cosine(90 * true_pose[4]);
  const double peak = 1 / (kTwoPi * std::sqrt(along * across));
  std::vector<float> pixels(std::size_t{kPixels} * kPixels);
  for (std::uint32_t row = 0; row < kPixels; ++row)
    for (std::uint32_t column = 0; column < kPixels; ++column) {
      const double dx = (column + 0.5) * kPitchMm - 1 - x_mm;
      const double dy = 1 - (row + 0.5) * kPitchMm - y_mm;  // y is up
      const double u = angle.cosine * dx + angle.sine * dy;
      const double v = angle.cosine * dy - angle.sine * dx;
      const double density = peak * relign::portable_exp(-0.5 * (u * u / along + v * v / across));
      pixels[std::size_t{row} * kPixels + column] = static_cast<float>(density);
    }
  return pixels;
}

class Spot final : public relign::Assembly {
 public:
  Spot(double photons, const std::vector<float>& reference)
      : photons_per_density_(photons * kPitchMm * kPitchMm), reference_(reference) {}

  // Photon noise: the variance of a pixel's photon count is its mean.
  void capture(const relign::Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
    const std::vector<float> clean = render(true_pose);
    relign::Random random(frame_seed);
    for (std::size_t i = 0; i < clean.size(); ++i) {
      const double density = clean[i];
      const double noise = photons_per_density_ > 0 ? std::sqrt(density / photons_per_density_) * random.normal() : 0;
      pixels[i] = static_cast<float>(density + noise);
    }
  }

  Truth noise_free_mse(const relign::Pose& true_pose, std::uint64_t /*seed*/) override {
    const std::vector<float> clean = render(true_pose);
    double sum = 0;
    for (std::size_t i = 0; i < clean.size(); ++i) {
      const double difference = double{clean[i]} - reference_[i];
      sum += difference * difference;
    }
    return {sum / static_cast<double>(clean.size()), 0};
  }

  bool render_noise_free(const relign::Pose& true_pose, float* pixels) override {
    const std::vector<float> clean = render(true_pose);
    std::copy(clean.begin(), clean.end(), pixels);
    return true;
  }

 private:
  double photons_per_density_;
  const std::vector<float>& reference_;
};

class GaussianSpot final : public relign::Scene {
 public:
  explicit GaussianSpot(const relign::Parameters& given)
      : photons_(given.number("photons")), reference_(render(nominal_pose())) {}

  std::string describe() override {
    const auto axis = [](const char* name, const char* unit, double lower, double upper) {
      return Json{{"name", name}, {"unit", unit}, {"lower", lower}, {"upper", upper}};
    };
    return Json{{"name", "gaussian_spot"},
                {"summary", "A Gaussian density of five parameters: place, two widths, angle."},
                {"axes",
                 {axis("x", "mm", -1, 1), axis("y", "mm", -1, 1), axis("width_1", "mm", 0, 1),
                  axis("width_2", "mm", 0, 1), axis("angle", "deg", 0, 90)}},
                {"nominal_pose", nominal_pose()},
                {"image", {{"width", kPixels}, {"height", kPixels}, {"white", kPeakAtNominal}}},
                {"elements", Json::array()}}
        .dump();
  }

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

  std::unique_ptr<relign::Assembly> mount(std::string_view offsets_json) override {
    if (!Json::parse(offsets_json).empty())
      throw std::invalid_argument("gaussian_spot has no elements, offsets must be empty");
    return std::make_unique<Spot>(photons_, reference_);
  }

 private:
  double photons_;
  std::vector<float> reference_;
};

}  // namespace

RELIGN_PLUGIN(GaussianSpot)
