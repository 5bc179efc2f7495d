// For tests of the conformance checks: a small sound station; with a CROOKED_* defined, one that breaks a promise.
#include <cmath>
#include <limits>
#include <relign/plugin.hpp>
#include <string>
#include <vector>

namespace {

constexpr std::uint32_t kSide = 8;

class CrookedStation final : public relign::Station {
 public:
  explicit CrookedStation(const relign::Parameters&) : reference_(std::size_t{kSide} * kSide, 0.5F) {}

  std::string describe() override {
    return R"({"name": "crooked", "owns_stage": true, "truth": false, "image": {"width": 8, "height": 8, "white": 1},
      "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, {"name": "y", "unit": "mm", "lower": -1, "upper": 1}]})";
  }
  relign_image reference() override {
    return {sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, reference_.data(), kSide * sizeof(float)};
  }

  void begin(std::uint64_t seed) override {
#ifdef CROOKED_WANDERS
    static std::uint64_t begins = 0;  // every start differs, which is allowed
    seed += 1000 * ++begins;
#endif
    relign::Random random(seed);
    for (double& place : place_) place = random.uniform();
  }

  Moved move_by(const relign::Pose& delta) override {
    Moved made;
    made.machine_seconds = 0.1;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double before = place_[axis];
      place_[axis] += delta[axis];
#ifndef CROOKED_ENDLESS
      if (place_[axis] < 0) made.limits_low |= std::uint64_t{1} << axis;
      if (place_[axis] > 1) made.limits_high |= std::uint64_t{1} << axis;
      place_[axis] = std::min(1.0, std::max(0.0, place_[axis]));
#endif
      made.moved.push_back(place_[axis] - before);
    }
#ifdef CROOKED_MOVES_NAN
    made.moved[1] = std::nan("");
#endif
#ifdef CROOKED_TOO_MANY_AXES
    if (made.limits_high) made.limits_high |= 1U << 2;
#endif
#ifdef CROOKED_SILENT
    made.limits_low = made.limits_high = 0;
#endif
#ifdef CROOKED_BACK_IN_TIME
    made.machine_seconds = -0.1;
#endif
#ifdef CROOKED_AFRAID
    if (made.limits_low || made.limits_high) throw std::runtime_error("it met a limit");
#endif
    return made;
  }

  double capture(float* pixels) override {
    for (std::size_t i = 0; i < reference_.size(); ++i)
      pixels[i] = static_cast<float>(0.5 + 0.01 * place_[0] * static_cast<double>(i) + 0.01 * place_[1]);
#ifdef CROOKED_DARK
    pixels[5] = std::nanf("");
#endif
#ifdef CROOKED_TIMELESS
    return std::numeric_limits<double>::infinity();
#else
    return 0.05;
#endif
  }

 private:
  std::vector<float> reference_;
  double place_[2] = {0, 0};
};

}  // namespace

RELIGN_PLUGIN(CrookedStation)
