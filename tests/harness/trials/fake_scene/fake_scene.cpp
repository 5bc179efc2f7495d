// A scene whose scores can be computed by hand. Three axes (x, y in mm, Rx in deg); 3 x 2 pixels.
// Reference: 0.5 everywhere, in rows with a gap between them. Capture: 0.5 + d + noise, where d is the distance of the
// true pose from the optimum (0.5 on every axis, x moved by the offset of L1) and the noise is one number
// made from the frame seed. Noise-free MSE: d^2 + 1e-6 u(seed), standard error 1e-7.
// Every call is logged with its arguments, so that tests see seeds and counts.
#include <algorithm>
#include <cmath>
#include <relign/plugin.hpp>
#include <sstream>

namespace {

double unit(std::uint64_t seed) { return relign::Random(seed).uniform(); }

struct Settings {
  double noise;
  double tint;
  std::int64_t fail_at;
  std::int64_t bad_pixel_at;
  bool regions;
};

class FakeAssembly final : public relign::Assembly {
 public:
  FakeAssembly(const relign::Parameters& host, const Settings& settings, double shift)
      : host_(host), settings_(settings), shift_(shift) {}

  void capture(const relign::Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
    log("capture", frame_seed);
    log("buffer", reinterpret_cast<std::uintptr_t>(pixels));
    const std::int64_t number = captures_++;
    if (number == settings_.fail_at) throw std::runtime_error("the lamp is out");
    const double value = 0.5 + settings_.tint + distance(true_pose) + settings_.noise * unit(frame_seed);
    for (int i = 0; i < 6; ++i) pixels[i] = static_cast<float>(value);
    if (number == settings_.bad_pixel_at) pixels[3] = std::nanf("");
  }

  // 7 in the other pixels, which count for nothing. Regions must not overlap.
  std::optional<double> capture_regions(const relign::Pose& true_pose, std::uint64_t frame_seed,
                                        const std::vector<relign::Region>& regions, float* pixels) override {
    float whole[6];
    capture(true_pose, frame_seed, whole);
    std::fill_n(pixels, 6, 7.0F);
    double share = 0;
    for (const relign::Region& region : regions)
      for (std::uint32_t row = region.row; row < region.row + region.rows; ++row)
        for (std::uint32_t column = region.column; column < region.column + region.columns; ++column, share += 1.0 / 6)
          pixels[row * 3 + column] = whole[row * 3 + column];
    return share;
  }

  // Each image is constant, but for its last pixel.
  bool render_slopes(const relign::Pose& pose, std::uint64_t, std::uint32_t samples,
                     const std::vector<std::uint32_t>& elements, float* pixels) override {
    const auto add = [&](double value) {
      std::fill_n(pixels, 6, static_cast<float>(value));
      pixels[5] += static_cast<float>(samples);
      pixels += 6;
    };
    add(distance(pose));
    for (const double place : pose) add(place);
    for (const std::uint32_t element : elements)
      for (int offset = 0; offset < 5; ++offset) add(10 * (element + 1) + offset);
    return true;
  }

  Truth noise_free_mse(const relign::Pose& true_pose, std::uint64_t seed) override {
    log("truth", seed);
    const double d = distance(true_pose);
    return {d * d + 1e-6 * unit(seed), 1e-7};
  }

  // Three fields, 100 px apart, that x and y shift and Rx rotates about the middle one. MTF: 0.9, less 10 times the
  // squared distance of x from 0.5 (middle), 0.6 (left) or 0.48 (right) and the square of that of Rx from 0.5; sagittal
  // is 0.2 less. No light at x = 0.
  std::vector<FieldValues> fields(const relign::Pose& pose, double, const std::vector<std::uint32_t>& which) override {
    const double degree = 0.017453292519943295, best[] = {0.5, 0.6, 0.48}, from_middle[] = {0, -100, 100};
    std::vector<FieldValues> values;
    for (const std::uint32_t field : which) {
      if (pose[0] == 0) {
        values.push_back({std::nan(""), std::nan(""), 0, 0});
        continue;
      }
      const double turn = pose[2] - 0.5, off = pose[0] - best[field];
      const double mtf = std::max(0.2, 0.9 - 10 * off * off - turn * turn);
      values.push_back({150 + from_middle[field] + 100 * (pose[0] - 0.5),
                        200 + from_middle[field] * std::tan(14 * degree * turn) + 100 * (pose[1] - 0.5), mtf,
                        mtf - 0.2});
    }
    return values;
  }

 private:
  double distance(const relign::Pose& pose) const {
    double squares = 0;
    for (std::size_t i = 0; i < pose.size(); ++i) {
      const double difference = pose[i] - 0.5 - (i == 0 ? shift_ : 0.0);
      squares += difference * difference;
    }
    return std::sqrt(squares);
  }
  void log(const char* what, std::uint64_t value) const { host_.warn(std::string(what) + " " + std::to_string(value)); }
  relign::Parameters host_;
  Settings settings_;
  double shift_;
  std::int64_t captures_ = 0;
};

class FakeScene final : public relign::Scene {
 public:
  explicit FakeScene(const relign::Parameters& given)
      : host_(given),
        settings_{given.number("noise"), given.text("look") == "tinted" ? 0.25 : 0, given.integer("fail_at"),
                  given.integer("bad_pixel_at"), given.boolean("regions")},
        renamed_(given.text("look") == "renamed"),
        reference_{0.5F, 0.5F, 0.5F, 1e9F, 0.5F, 0.5F, 0.5F, 1e9F} {}

  std::string describe() override {
    const std::string elements = renamed_ ? R"(["M1"]})" : R"(["L1", "L2"]})";
    return R"({"name": "fake", "summary": "by hand",
      "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1},
               {"name": "y", "unit": "mm", "lower": -1, "upper": 1},
               {"name": "Rx", "unit": "deg", "lower": -7, "upper": 7}],
      "nominal_pose": [0.5, 0.5, 0.5],
      "image": {"width": 3, "height": 2, "white": 0.5},
      "elements": )" +
           elements;
  }

  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    image.sample_format = RELIGN_SAMPLE_FLOAT32;
    image.width = 3;
    image.height = 2;
    image.channels = 1;
    image.pixels = reference_;
    image.row_stride_bytes = 4 * sizeof(float);  // the fourth value of a row is padding
    return image;
  }

  std::unique_ptr<relign::Assembly> mount(std::string_view offsets_json) override {
    // Only what the tests mount: {"L1":{"shift_mm":[0.1,... moves the optimum by 0.1 of the travel.
    const std::string text(offsets_json);
    const std::string key = "\"L1\":{\"shift_mm\":[";
    const auto found = text.find(key);
    const double shift = found == std::string::npos ? 0 : std::stod(text.substr(found + key.size()));
    return std::make_unique<FakeAssembly>(host_, settings_, shift);
  }

  bool captures_regions() const override { return settings_.regions; }

 private:
  relign::Parameters host_;
  Settings settings_;
  bool renamed_;
  float reference_[8];
};

}  // namespace

RELIGN_PLUGIN(FakeScene)
