// For tests of the conformance checks: a small sound scene; with a CROOKED_* defined, one that breaks a promise.
#include <cmath>
#include <relign/plugin.hpp>
#include <relign/random.hpp>
#include <string>
#include <vector>

namespace {

constexpr std::uint32_t kSide = 8;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

#ifdef CROOKED_REMEMBERS
double captures_so_far = 0;
#endif

// A ramp whose slope depends on the pose.
std::vector<float> picture(const relign::Pose& pose) {
  double sum = 0;
  for (const double value : pose) sum += std::isfinite(value) ? value - 0.5 : 0.0;
  std::vector<float> pixels(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    pixels[i] = static_cast<float>(0.5 + 0.1 * sum * (static_cast<double>(i) / kPixels - 0.3));
  return pixels;
}

class CrookedAssembly final : public relign::Assembly {
 public:
  void capture(const relign::Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
#ifdef CROOKED_AFRAID_OF_ENDS
    if (true_pose[0] >= 1) throw std::runtime_error("this pose is not supported");
#endif
    std::vector<float> clean = picture(true_pose);
    relign::Random random(frame_seed);
    for (float& value : clean) value += static_cast<float>(0.01 * random.normal());
#ifdef CROOKED_REMEMBERS
    clean[0] += static_cast<float>(++captures_so_far);
#endif
#ifdef CROOKED_NAN
    clean[5] = std::nanf("");
#endif
    std::copy(clean.begin(), clean.end(), pixels);
  }
  Truth noise_free_mse(const relign::Pose& true_pose, std::uint64_t seed) override {
    const std::vector<float> here = picture(true_pose);
    const std::vector<float> perfect = picture({});
    double mse = 0;
    for (std::size_t i = 0; i < kPixels; ++i)
      mse += (double{here[i]} - double{perfect[i]}) * (double{here[i]} - double{perfect[i]}) / kPixels;
    double standard_error = 0.02 * mse + 1e-9;
#ifdef CROOKED_BIASED
    const double bias = 0.5 * mse;
#else
    const double bias = 0;
#endif
    relign::Random random(seed, 9);
    const double value = mse + bias + standard_error * random.normal();
#ifdef CROOKED_OVERCONFIDENT
    standard_error /= 50;
#endif
    return {value, standard_error};
  }
  bool render_noise_free(const relign::Pose& true_pose, float* pixels) override {
    const std::vector<float> clean = picture(true_pose);
    std::copy(clean.begin(), clean.end(), pixels);
    return true;
  }
#ifdef CROOKED_MTF
  std::optional<FieldMtf> mtf(const relign::Pose&, double lp_per_mm) override {
    const double share = lp_per_mm / (1 + lp_per_mm);  // rises with the frequency
    return FieldMtf{share, share};
  }
#endif
#ifdef CROOKED_OPTIMUM
  std::optional<Optimum> own_optimum(std::uint64_t seed) override {
    const relign::Pose corner(3, 1.0);
    const Truth there = noise_free_mse(corner, seed);
    return Optimum{corner, there.mse, there.standard_error};
  }
#endif
};

class CrookedScene final : public relign::Scene {
 public:
  explicit CrookedScene(const relign::Parameters&) : reference_(picture({})) {
#ifdef CROOKED_REFERENCE
    static int objects = 0;
    reference_[3] += static_cast<float>(++objects);
#endif
  }
  std::string describe() override {
#ifdef CROOKED_DESCRIPTION
    return R"({"name": "crooked"})";
#else
    return R"({"name": "crooked", "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1},
      {"name": "y", "unit": "mm", "lower": -1, "upper": 1}, {"name": "z", "unit": "mm", "lower": -1, "upper": 1}],
      "nominal_pose": [0.5, 0.5, 0.5], "image": {"width": 8, "height": 8, "white": 1}, "elements": ["L1"]})";
#endif
  }
  relign_image reference() override {
    return {sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, reference_.data(), kSide * sizeof(float)};
  }
  std::unique_ptr<relign::Assembly> mount(std::string_view offsets) override {
#ifdef CROOKED_ANY_ELEMENT
    static_cast<void>(offsets);
#else
    if (offsets != "{}" && offsets.find("\"L1\"") == std::string_view::npos)
      throw std::runtime_error("unknown element; known: L1");
#endif
    return std::make_unique<CrookedAssembly>();
  }

 private:
  std::vector<float> reference_;
};

}  // namespace

RELIGN_PLUGIN(CrookedScene)
