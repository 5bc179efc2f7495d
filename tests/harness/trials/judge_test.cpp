// Criteria of every step on the fake scene, whose fields are formulas of the pose (fake_scene.cpp).
#include "trials/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "trials/fakes.h"

namespace relign::trials {
namespace {

using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

struct JudgedLens : TrialFixture {
  JudgedLens() : TrialFixture("[]") {
    for (const char* name : {"centre", "left", "right"})
      facts.fields.push_back({name, {}, images::Region{0, 0, 1, 1}, {}});
    facts.image_width = 300;
    facts.image_height = 400;
    criteria.lp_per_mm = 20;
    criteria.field_mtf = {{1, 0.5, std::nan("")}, {2, 0.5, 0.4}};
    criteria.judged.values.fill(true);
    lens.emplace(scene->mount("{}"));
    design = measure_fields(*lens, facts, criteria.lp_per_mm, facts.nominal_pose);
    judge.emplace(*lens, facts, criteria, design, 1);
  }
  Criteria criteria;
  std::optional<plugin_host::MountedAssembly> lens;
  FieldValues design;
  std::optional<Judge> judge;
};

TEST(Judge, AreTheFormulasOfThePose) {
  JudgedLens fake;
  const double dx = 0.03, dy = -0.04, turn = 0.02;
  const ByCriterion<double> judged = fake.judge->at({0.5 + dx, 0.5 + dy, 0.5 + turn}, {0.5, 0.49, 0.51});
  // "left": 0.9 - 10 (dx - 0.1)^2 - turn^2; "right": 0.9 - 10 (dx + 0.02)^2 - turn^2, sagittal 0.2 less.
  EXPECT_NEAR(judged[criterion_named("field_mtf_deficit")], 0.4 - (0.7 - 10 * 0.05 * 0.05 - turn * turn), 1e-12);
  EXPECT_NEAR(judged[criterion_named("centre_px")], 100 * std::hypot(dx, dy), 1e-9);
  EXPECT_NEAR(judged[criterion_named("rotation_px")], std::tan(14 * turn * kDegree) * 250, 0.01)
      << "half of the diagonal: 250 px";
  EXPECT_NEAR(judged[criterion_named("pose_um")], 2000 * std::hypot(dx, dy + 0.01), 1e-9) << "2 mm of travel";
  EXPECT_NEAR(judged[criterion_named("tilt_arcmin")], 60 * 14 * 0.01, 1e-9);
}

TEST(Judge, CountObservableAxesOnly) {
  JudgedLens fake;
  fake.facts.axes[1].observable = fake.facts.axes[2].observable = false;
  const ByCriterion<double> judged = fake.judge->at({0.52, 0.9, 0.9}, {0.5, 0.5, 0.5});
  EXPECT_NEAR(judged[criterion_named("pose_um")], 40, 1e-9);
  EXPECT_EQ(judged[criterion_named("tilt_arcmin")], 0);
}

TEST(Judge, OptimumBalancesTheWorstFields) {
  JudgedLens fake;
  fake.criteria.field_mtf = {{1, 0.5, std::nan("")}, {2, 0.5, std::nan("")}};
  for (const std::vector<double>& start : {std::vector<double>{0.5, 0.5, 0.5}, {0.4, 0.6, 0.7}, {0.6, 0.52, 0.3}}) {
    const auto found = fake.judge->optimum(start);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->true_pose[0], 0.54, 1e-4) << "where both fields are equal";
    EXPECT_NEAR(found->true_pose[1], 0.5, 1e-3) << "no field depends on it: where the image is not shifted";
    EXPECT_NEAR(found->true_pose[2], 0.5, 5e-3);
    EXPECT_NEAR(found->deficit, 0.5 - (0.9 - 10 * 0.06 * 0.06), 1e-4);
  }
  fake.criteria.field_mtf.clear();
  EXPECT_FALSE(fake.judge->optimum({0.5, 0.5, 0.5})) << "no limit of MTF";
}

TEST(Judge, OptimumLeavesUnobservableAxes) {
  JudgedLens fake;
  fake.facts.axes[2].observable = false;
  EXPECT_EQ(fake.judge->optimum({0.45, 0.5, 0.7})->true_pose[2], 0.7);
}

TEST(Judge, AreUnknownWithoutLightOrOptimum) {
  JudgedLens fake;
  const ByCriterion<double> dark = fake.judge->at({0.0, 0.5, 0.5}, {});
  EXPECT_EQ(dark[criterion_named("field_mtf_deficit")], 0.5) << "MTF 0";
  EXPECT_TRUE(std::isnan(dark[criterion_named("centre_px")]));
  EXPECT_TRUE(std::isnan(dark[criterion_named("rotation_px")]));
  EXPECT_TRUE(std::isnan(dark[criterion_named("pose_um")]));
}

}  // namespace
}  // namespace relign::trials
