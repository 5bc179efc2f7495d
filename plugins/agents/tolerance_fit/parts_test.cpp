// Parts of tolerance-fit: level summary, aligner, joint fit, image shifts, binning.
#include <gtest/gtest.h>

#include <relign/random.hpp>

#include "aligner.hpp"
#include "toy_lens_test.h"

namespace relign {
namespace {

using tolerance_fit::Matrix;
using tolerance_fit::Vector;

TEST(Level, SummarisesDraws) {
  std::vector<std::string> draws;
  for (std::uint64_t k = 0; k < 2000; ++k) {
    Random random(k);
    const double tilt = 0.5 + 2 * random.normal();
    const nlohmann::json elements = {{"L1", {{"shift_mm", {0, 0, 0}}, {"tilt_deg", {tilt, 0}}}},
                                     {"L2", {{"shift_mm", {3 * tilt, 0.1 * random.normal(), 7}}}}};
    draws.push_back(nlohmann::json{
        {"start", {random.uniform(), 0.25}},
        {"distortion", {{1 + 0.01 * random.normal(), 0}, {0.1, 1}}},
        {"elements",
         elements}}.dump());
  }
  const tolerance_fit::Level level = tolerance_fit::summarise(draws, 2);
  EXPECT_NEAR(level.start_mean[0], 0.5, 0.03);
  EXPECT_NEAR(level.start_std[0], std::sqrt(1 / 12.0), 0.01);
  EXPECT_EQ(level.start_mean[1], 0.25);
  EXPECT_EQ(level.start_std[1], 0);
  EXPECT_NEAR(level.distortion_std(0, 0), 0.01, 0.001);
  EXPECT_NEAR(level.distortion_mean(1, 0), 0.1, 1e-9);
  EXPECT_EQ(level.distortion_std(0, 1), 0);
  // L1's tilt about x and L2's shifts along x, y and z (constant, but not 0); offsets that are always 0 are left out.
  ASSERT_EQ(level.offsets.size(), 4u);
  EXPECT_TRUE(level.offsets[0].element == "L1" && level.offsets[0].tilt && level.offsets[0].axis == 0);
  EXPECT_NEAR(level.offset_mean[0], 0.5, 0.2);
  EXPECT_NEAR(level.offset_std[0], 2, 0.15);
  EXPECT_NEAR(level.offset_mean[3], 7, 1e-9);
  EXPECT_NEAR(level.offset_correlation(0, 1), 1, 1e-9);  // a tilt about another pivot
  EXPECT_EQ(level.offset_correlation(0, 2), 0);          // chance correlations are removed
  const auto written = nlohmann::json::parse(tolerance_fit::offsets_json(level.offsets, Vector::Constant(4, 0.5)));
  EXPECT_EQ(written["L1"]["tilt_deg"], (nlohmann::json{0.5, 0.0}));
  EXPECT_EQ(written["L2"]["shift_mm"], (nlohmann::json{0.5, 0.5, 0.5}));
}

std::shared_ptr<const tolerance_fit::Knowledge> learnt(Trial& trial, tolerance_fit::Pictures& pictures) {
  std::vector<std::string> draws;
  for (std::uint64_t k = 0; k < 400; ++k) draws.push_back(trial.prior().draw(k));
  const auto axes = static_cast<Eigen::Index>(trial.axes());
  return std::make_shared<const tolerance_fit::Knowledge>(tolerance_fit::learn(
      tolerance_fit::summarise(draws, trial.axes()), {Vector::Constant(axes, 0.5), 6, 200, 32}, pictures));
}

TEST(Aligner, EstimatesOffsetOfTheLens) {
  double squares = 0, errors = 0;
  for (std::uint64_t instance = 1; instance <= 4; ++instance) {
    test::ToyTrial::Setup setup;
    setup.instance = instance;
    test::ToyTrial toy(setup);
    Trial trial(&toy.trial->handle());
    tolerance_fit::Pictures pictures(trial.model());
    const auto known = learnt(trial, pictures);
    EXPECT_NEAR(known->dark, 4e-4, 1e-4);  // noise is the same in every pixel
    ASSERT_EQ(known->combinations.cols(), 1);
    const ImageView reference = trial.reference();
    const std::vector<double> wanted(reference.row(0), reference.row(0) + pictures.size().pixels());
    tolerance_fit::Aligner aligner(known, trial.model(), wanted, false);
    auto observation = std::optional<Observation>(trial.first());
    for (int step = 0; step < 5; ++step) {
      aligner.add(*observation);
      aligner.update();
      observation = trial.step(tolerance_fit::to_pose(aligner.target()));
    }
    squares += toy.offset() * toy.offset();
    errors += std::pow(aligner.offsets()[0] - toy.offset(), 2);
  }
  EXPECT_GT(squares, 1);
  EXPECT_LT(errors, 0.02 * squares);
}

TEST(JointFit, UsesLimitSwitches) {
  test::ToyTrial::Setup setup;
  setup.axes = 1;
  setup.noise = 1e3;  // images contain no information
  test::ToyTrial toy(setup);
  Trial trial(&toy.trial->handle());
  tolerance_fit::Pictures pictures(trial.model());
  const auto known = learnt(trial, pictures);
  const tolerance_fit::Layout layout(*known);
  tolerance_fit::Derivatives derivatives(*known, pictures, known->fine, {});
  const auto pose_after = [&](double commanded, std::uint64_t low, std::uint64_t high) {
    const tolerance_fit::Site site{Vector::Constant(1, commanded), low, high, 1,
                                   std::vector<double>(pictures.size().pixels(), 0.0)};
    Vector x = Vector::Zero(layout.size());
    tolerance_fit::JointFit fit(*known, layout, derivatives, pictures.size(), {}, {&site}, x);
    fit.solve(x, 20, 1e-4);
    return layout.pose(x, site.commanded)[0];
  };
  EXPECT_NEAR(pose_after(-0.3, 0, 0), 0.2, 0.03);  // mean start of the level plus the move
  EXPECT_NEAR(pose_after(-0.3, 1, 0), 0, 0.01);    // hit the lower limit
  EXPECT_NEAR(pose_after(-0.7, 0, 0), 0, 0.01);    // hit no limit: within the travel
  EXPECT_NEAR(pose_after(-0.7, 1, 0), -0.2, 0.03);
  EXPECT_NEAR(pose_after(0.3, 0, 1), 1, 0.01);
  EXPECT_NEAR(pose_after(0.7, 0, 0), 1, 0.01);
}

TEST(Pictures, BinsAreMeansAndBlurHasUnitSum) {
  std::vector<double> pixels(10 * 6, 0.0);
  pixels[0] = 4;
  pixels[2 * 10 + 7] = 8;
  pixels[9] = 100;  // in an incomplete bin
  const Vector bins = tolerance_fit::binned(pixels, {10, 6}, {3, 0, 0});
  ASSERT_EQ(bins.size(), 6);
  EXPECT_DOUBLE_EQ(bins[0], 4 / 9.0);
  EXPECT_DOUBLE_EQ(bins[2], 8 / 9.0);
  EXPECT_EQ(bins[5], 0);
  std::vector<float> middle(41 * 41, 0.0F);
  middle[20 * 41 + 20] = 1;
  const Vector blurred = tolerance_fit::binned(middle, {41, 41}, {1, 2, 0});
  EXPECT_NEAR(blurred.sum(), 1, 1e-6);
  EXPECT_NEAR(blurred.squaredNorm(), tolerance_fit::noise_left({1, 2, 0}), 1e-9);
}

}  // namespace
}  // namespace relign
