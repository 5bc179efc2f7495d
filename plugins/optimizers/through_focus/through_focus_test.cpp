#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign::through_focus {
namespace {

constexpr std::uint32_t kSide = 64;

// A toy scene: a grid of soft edges that shifts with the first two axes and with the tilts, and whose blur grows with
// the distance from a plane of best focus.
class ToyStation {
 public:
  explicit ToyStation(std::uint32_t axes) : pose_(axes, 0.0), wanted_(std::size_t{kSide} * kSide) {
    optimum_ = {0.07, -0.05, 0.06, -0.08, 0.05, 0.11};
    optimum_.resize(axes, 0.0);
    draw(optimum_, wanted_.data());
    image_ = {sizeof image_, RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, wanted_.data(), kSide * sizeof(float)};
    reference_ = {};
    reference_.struct_size = sizeof reference_;
    reference_.image = &image_;
    measures_ = {};
    measures_.struct_size = sizeof measures_;
    measures_.context = this;
    measures_.measure = [](void* self, relign_text name, relign_text, double* value) -> relign_status {
      const auto* toy = static_cast<const ToyStation*>(self);
      const std::string_view wanted(name.data, static_cast<std::size_t>(name.size));
      if (toy->is_dark()) {
        *value = std::nan("");
      } else if (wanted == "rotation_deg") {
        *value = -7 * toy->away(toy->pose_, 5);
      } else {
        *value = toy->shift(toy->pose_, wanted == "shift_x_px" ? 0 : 1);
      }
      return RELIGN_OK;
    };
  }

  test::FakeSetup setup() {
    test::FakeSetup setup;
    setup.axes = static_cast<std::uint32_t>(pose_.size());
    setup.observes = RELIGN_OBSERVES_IMAGES | RELIGN_OBSERVES_START | RELIGN_OBSERVES_BOX;
    setup.image_side = kSide;
    setup.merit = [this](const test::Pose& pose, std::uint32_t step) {
      pose_ = pose;
      step_ = step;
      return 0.0;
    };
    setup.paint = [this](double, float* pixels) {
      draw(pose_, pixels);
      Random noise(step_);
      for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        pixels[i] += static_cast<float>(0.02 * noise.normal());
        if (is_dark()) pixels[i] = 0;
      }
    };
    setup.service = [this](std::string_view id) -> const void* {
      if (id == RELIGN_SERVICE_REFERENCE) return &reference_;
      if (id == RELIGN_SERVICE_MEASURES) return &measures_;
      return nullptr;
    };
    return setup;
  }

  test::Pose optimum_;
  double lit = 1e9;  // farther from the optimum than this on any axis images are dark and shifts unknown

 private:
  bool is_dark() const {
    double furthest = 0;
    for (std::size_t axis = 0; axis < pose_.size(); ++axis) furthest = std::max(furthest, std::fabs(away(pose_, axis)));
    return furthest > lit;
  }
  double away(const test::Pose& pose, std::size_t axis) const {
    return axis < pose.size() ? pose[axis] - optimum_[axis] : 0;
  }
  std::size_t focus() const { return pose_.size() == 1 ? 0 : 2; }
  double shift(const test::Pose& pose, std::size_t side) const {
    if (pose.size() == 1) return 0;
    return 20 * away(pose, side) + 3 * away(pose, 1 - side) + (side == 0 ? 15 : -15) * away(pose, 4 - side);
  }
  void draw(const test::Pose& pose, float* pixels) const {
    for (std::uint32_t row = 0; row < kSide; ++row)
      for (std::uint32_t column = 0; column < kSide; ++column) {
        const double u = column - 31.5 - shift(pose, 0), v = row - 31.5 - shift(pose, 1);
        const double defocus = away(pose, focus()) + 0.4 * (away(pose, 3) * v - away(pose, 4) * u) / 31.5;
        const double blur = std::sqrt(0.25 + 100 * defocus * defocus);
        pixels[row * kSide + column] = static_cast<float>(0.5 + 0.2 * std::tanh(std::sin(0.4 * u + 0.03 * v) / blur) +
                                                          0.2 * std::tanh(std::sin(0.4 * v - 0.03 * u) / blur));
      }
  }

  test::Pose pose_;
  std::uint32_t step_ = 0;
  std::vector<float> wanted_;
  relign_image image_{};
  relign_reference_service reference_{};
  relign_measures_service measures_{};
};

void run(const test::FakeTrial& trial) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/through_focus");
  plugin_host::Algorithm algorithm(catalog.resolve_or_throw(plugin_host::Kind::optimizer, "through-focus"), {});
  algorithm.run(trial.handle());
}

void expect_at_optimum(const test::FakeTrial& trial, const ToyStation& toy) {
  ASSERT_FALSE(trial.recommendations.empty());
  const test::Pose& pose = trial.recommendations.back().pose;
  for (std::size_t axis = 0; axis < pose.size(); ++axis)
    EXPECT_NEAR(pose[axis], toy.optimum_[axis], axis < 2 ? 0.015 : 0.02) << axis;
}

TEST(ThroughFocus, AlignsAllAxes) {
  for (const std::uint32_t axes : {1u, 3u, 4u, 5u, 6u}) {
    SCOPED_TRACE(axes);
    ToyStation toy(axes);
    test::FakeTrial trial(toy.setup());
    run(trial);
    EXPECT_FALSE(trial.stopped);
    EXPECT_LE(trial.steps.size(), 40u);
    expect_at_optimum(trial, toy);
  }
}

TEST(ThroughFocus, SearchesForTargetOutsideTheImage) {
  ToyStation toy(5);
  toy.lit = 0.3;
  test::FakeSetup setup = toy.setup();
  setup.start = {-0.45, 0.45, -0.4, 0.4, -0.45};
  setup.budget = 80;
  test::FakeTrial trial(setup);
  run(trial);
  EXPECT_FALSE(trial.stopped);
  expect_at_optimum(trial, toy);
}

// The tilts shift the image too far for the lateral axes alone: all four must move.
TEST(ThroughFocus, CentresWithTiltsAtTheLimits) {
  ToyStation toy(5);
  test::FakeSetup setup = toy.setup();
  toy.optimum_ = {0.3, -0.3, 0.06, 0.3, 0.3};
  setup.lower.assign(5, -0.4);
  setup.upper.assign(5, 0.4);
  setup.budget = 80;
  test::FakeTrial trial(setup);
  run(trial);
  expect_at_optimum(trial, toy);
}

TEST(ThroughFocus, EndsAtOnceWithRecommendationForAnyBudget) {
  for (std::uint32_t budget = 1; budget <= 30; ++budget) {
    SCOPED_TRACE(budget);
    ToyStation toy(5);
    test::FakeSetup setup = toy.setup();
    setup.budget = budget;
    setup.lower.assign(5, -0.12);
    setup.upper.assign(5, 0.12);
    test::FakeTrial trial(setup);
    run(trial);
    EXPECT_EQ(trial.requests_after_stop, 0u);
    ASSERT_FALSE(trial.recommendations.empty());
    for (const double value : trial.recommendations.back().pose) EXPECT_LE(std::fabs(value), 0.12);
    for (const auto& visit : trial.steps)
      for (const double value : visit.pose) EXPECT_LE(std::fabs(value), 0.12);
  }
}

TEST(ThroughFocus, DarkImagesEndTheTrial) {
  ToyStation toy(5);
  toy.lit = -1;
  test::FakeSetup setup = toy.setup();
  setup.budget = 100000;
  test::FakeTrial trial(setup);
  run(trial);
  EXPECT_FALSE(trial.stopped);
  EXPECT_EQ(trial.steps.size(), 40u);
}

}  // namespace
}  // namespace relign::through_focus
