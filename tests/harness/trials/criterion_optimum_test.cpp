// On formulas in place of a lens.
#include "trials/criterion_optimum.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relign::trials {
namespace {

double peak(double height, double at, double focus) {
  return height * std::exp(-(focus - at) * (focus - at) / (0.02 * 0.02));
}

// Two fields, left and right, with two foci each. A tilt moves their foci apart. Both lower peaks are at the start,
// both higher ones at a tilt of -0.25, far outside the neighbourhood that a local search sees.
struct TwoFoci {
  TwoFoci() {
    scene.axes = {{"z", "mm", -1, 1}, {"Ry", "deg", -1, 1}};
    scene.nominal_pose = {0.5, 0.5};
    criteria.field_mtf = {{0, 0.5, std::nan("")}, {1, 0.5, std::nan("")}};
    design = measure(scene.nominal_pose);
  }
  FieldValues measure(const std::vector<double>& pose) const {
    ++measured;
    const double z = pose[0] - 0.5, tilt = pose[1] - 0.5;
    FieldValues values(2);
    values[0].x_px = 100;
    values[1].x_px = 1100;
    values[0].y_px = values[1].y_px = 500;
    values[0].tangential = peak(0.6, 0, z - 0.2 * tilt) + peak(0.8, 0.05, z - 0.2 * tilt);
    values[1].tangential = peak(0.6, 0, z + 0.2 * tilt) + peak(0.8, -0.05, z + 0.2 * tilt);
    return values;
  }
  Judge::Optimum optimum(const std::vector<double>& start) const {
    return criterion_optimum([this](const std::vector<double>& pose) { return measure(pose); }, scene, criteria, design,
                             start);
  }
  SceneFacts scene;
  Criteria criteria;
  FieldValues design;
  mutable int measured = 0;
};

TEST(CriterionOptimum, IsTheHigherOfTwoFoci) {
  const TwoFoci lens;
  for (const std::vector<double>& start : {std::vector<double>{0.5, 0.5}, {0.53, 0.45}, {0.45, 0.6}}) {
    const Judge::Optimum found = lens.optimum(start);
    EXPECT_NEAR(found.true_pose[0], 0.5, 1e-3);
    EXPECT_NEAR(found.true_pose[1], 0.25, 5e-3);
    EXPECT_NEAR(found.deficit, 0.5 - (0.8 + peak(0.6, 0, 0.05)), 1e-4);
  }
}

TEST(CriterionOptimum, TakesAboutAsManyMeasurementsAsItIsSaidTo) {
  const TwoFoci lens;
  lens.optimum({0.5, 0.5});
  EXPECT_LT(lens.measured, kTypicalMeasurements);
  EXPECT_GT(lens.measured, 35) << "a curve of 31 places and the steps of an axis";
}

TEST(CriterionOptimum, IsLocalWithoutAFocus) {
  TwoFoci lens;
  lens.scene.axes[0].name = "height";
  EXPECT_NEAR(lens.optimum({0.5, 0.5}).true_pose[1], 0.5, 0.02) << "stays where it started";
}

TEST(CriterionOptimum, StandsFieldsInTheDark) {
  TwoFoci lens;
  const auto dark = [](const std::vector<double>&) { return FieldValues(2, {std::nan(""), std::nan(""), 0, 0}); };
  const Judge::Optimum found = criterion_optimum(dark, lens.scene, lens.criteria, lens.design, {0.5, 0.5});
  EXPECT_NEAR(found.deficit, 0.5, 1e-3);
  for (const double place : found.true_pose) EXPECT_TRUE(place >= 0 && place <= 1) << place;
}

}  // namespace
}  // namespace relign::trials
