#include "focus_curves.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <relign/random.hpp>

#include "marks.hpp"

namespace field_focus {
namespace {

// 3 x 3 fields whose best foci are on a plane, plus or minus astigmatism, less a curvature of field.
struct Lens {
  Focus optimum{0.03, -0.05, 0.08};
  double astigmatism = 0, curvature = 0, width = 0.07;

  std::vector<Channel> channels() const {
    std::vector<Channel> channels;
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        for (int direction = 0; direction < 2; ++direction) channels.push_back({{0.15 * x, -0.1 * y}, {}});
    return channels;
  }
  double centre(std::size_t channel, const Channel& of) const {
    return of.defocus(optimum) + (channel % 2 ? astigmatism : -astigmatism) - curvature * of.slope.squaredNorm();
  }
  double mtf(std::size_t channel, const Channel& of, const Focus& pose) const {
    return Curve{std::log(0.8), centre(channel, of), width}.at(of.defocus(pose));
  }
  void capture(std::vector<Channel>& channels, const Focus& pose, relign::Random* noise = nullptr) const {
    for (std::size_t i = 0; i < channels.size(); ++i)
      channels[i].samples.push_back({pose, mtf(i, channels[i], pose) + (noise ? 0.005 * noise->normal() : 0)});
  }
};

void expect_near(const Focus& found, const Focus& wanted, double focus, double tilt) {
  EXPECT_NEAR(found[0], wanted[0], focus);
  EXPECT_NEAR(found[1], wanted[1], tilt);
  EXPECT_NEAR(found[2], wanted[2], tilt);
}

// From a first solution, with captures about it, as the method takes them.
Focus best_by_near_curves(const Lens& lens, std::vector<Channel>& channels, Focus best) {
  constexpr double kReach = 0.06;
  for (int round = 0; round < 2; ++round) {
    for (const double z : {-0.03, -0.01, 0.01, 0.03}) lens.capture(channels, best + Focus(z, 0, 0));
    fit_near(channels, best, kReach);
    best = best_of_worst(channels, best, kReach);
  }
  return best;
}

TEST(FocusCurves, FindsPlaneOfBestFocus) {
  const Lens lens;
  std::vector<Channel> channels = lens.channels();
  for (int k = -2; k <= 2; ++k) lens.capture(channels, {0.06 * k, 0, 0});
  EXPECT_EQ(fit(channels, 0.06), 18);
  for (const Channel& channel : channels) EXPECT_NEAR(channel.curve->width, lens.width, 1e-9);
  expect_near(plane_of_best_focus(channels), lens.optimum, 1e-6, 1e-5);
}

TEST(FocusCurves, AstigmatismAndNoiseAverageOut) {
  Lens lens;
  lens.astigmatism = 0.02;
  std::vector<Channel> channels = lens.channels();
  relign::Random noise(1);
  for (int k = -2; k <= 2; ++k) lens.capture(channels, {0.06 * k, 0, 0}, &noise);
  EXPECT_EQ(fit(channels, 0.06), 18);
  expect_near(plane_of_best_focus(channels), lens.optimum, 0.002, 0.01);
}

// With a curved field the worst field is best at a compromise between centre and corners, not at the mean.
TEST(FocusCurves, MaximisesWorstField) {
  Lens lens;
  lens.curvature = 1;
  std::vector<Channel> channels = lens.channels();
  for (int k = -2; k <= 2; ++k) lens.capture(channels, {0.06 * k, 0, 0});
  fit(channels, 0.06);
  const auto worst = [&](const Focus& pose) {
    double lowest = 1;
    for (std::size_t i = 0; i < channels.size(); ++i) lowest = std::min(lowest, lens.mtf(i, channels[i], pose));
    return lowest;
  };
  const Focus plane = plane_of_best_focus(channels), found = best_by_near_curves(lens, channels, plane);
  const Focus compromise = lens.optimum - Focus(0.5 * (0.15 * 0.15 + 0.1 * 0.1), 0, 0);
  EXPECT_GT(worst(found), worst(plane) + 1e-3);
  EXPECT_NEAR(worst(found), worst(compromise), 1e-2);
  expect_near(found, compromise, 0.006, 0.01);
}

// How far the worst channel with a limit is above it.
double margin(const Lens& lens, const std::vector<Channel>& channels, const Focus& pose) {
  double lowest = 1;
  for (std::size_t i = 0; i < channels.size(); ++i)
    if (channels[i].limit) lowest = std::min(lowest, lens.mtf(i, channels[i], pose) - *channels[i].limit);
  return lowest;
}

// The centre is sharpest at optimum[0], the corners 0.0325 below: the more is asked of the centre, the nearer to its
// focus the solution.
TEST(FocusCurves, WeighsFieldsByTheirLimits) {
  Lens lens;
  lens.curvature = 1;
  constexpr std::size_t kCentre = 8;  // and 9: the two directions of the fifth field
  std::vector<Focus> found;
  for (const double more : {0.0, 0.02, 0.04}) {
    std::vector<Channel> channels = lens.channels();
    for (std::size_t i = 0; i < channels.size(); ++i) channels[i].limit = i / 2 == kCentre / 2 ? 0.6 + more : 0.6;
    for (int k = -2; k <= 2; ++k) lens.capture(channels, {0.06 * k, 0, 0});
    fit(channels, 0.06);
    found.push_back(best_by_near_curves(lens, channels, plane_of_best_focus(channels)));
    double highest = -1;
    for (double z = 0; z <= 0.03; z += 1e-4)
      highest = std::max(highest, margin(lens, channels, {z, lens.optimum[1], lens.optimum[2]}));
    EXPECT_NEAR(margin(lens, channels, found.back()), highest, 0.01) << more;
  }
  EXPECT_GT(found[1][0], found[0][0] + 0.001);
  EXPECT_GT(found[2][0], found[1][0] + 0.001);
}

TEST(FocusCurves, IgnoresFieldsWithoutALimit) {
  Lens lens;
  lens.curvature = 1;
  std::vector<Channel> channels = lens.channels();
  const auto is_corner = [](std::size_t i) { return i / 2 == 0 || i / 2 == 2 || i / 2 == 6 || i / 2 == 8; };
  for (std::size_t i = 0; i < channels.size(); ++i)
    if (!is_corner(i)) channels[i].limit.reset();
  for (int k = -2; k <= 2; ++k) lens.capture(channels, {0.06 * k, 0, 0});
  fit(channels, 0.06);
  const Focus found = best_by_near_curves(lens, channels, plane_of_best_focus(channels));
  expect_near(found, lens.optimum - Focus(0.15 * 0.15 + 0.1 * 0.1, 0, 0), 0.002, 0.01);
}

TEST(FocusCurves, StayWhereNoFieldHasALimit) {
  Lens lens;
  std::vector<Channel> channels = lens.channels();
  for (Channel& channel : channels) channel.limit.reset();
  for (int k = -2; k <= 2; ++k) lens.capture(channels, {0.06 * k, 0, 0});
  fit(channels, 0.06);
  EXPECT_EQ(best_by_near_curves(lens, channels, {0.01, 0.02, -0.03}), Focus(0.01, 0.02, -0.03));
}

// Peaks outside the sweep: extrapolated with the width of the other curves.
TEST(FocusCurves, ExtrapolatesFieldsBeyondTheSweep) {
  Lens lens;
  lens.optimum = {0.03, -0.6, 0.5};
  std::vector<Channel> channels = lens.channels();
  for (int k = -2; k <= 1; ++k) lens.capture(channels, {0.05 * k, 0, 0});
  EXPECT_GE(fit(channels, 0.05), 12);
  expect_near(plane_of_best_focus(channels), lens.optimum, 0.01, 0.06);
}

TEST(FocusCurves, DarkImagesHaveNoCurves) {
  std::vector<Channel> channels = Lens().channels();
  for (Channel& channel : channels) channel.samples = {{Focus(0, 0, 0), 0.0}, {Focus(0.1, 0, 0), 0.05}};
  EXPECT_EQ(fit(channels, 0.06), 0);
}

// A skewed curve, as coma leaves it: near the solution its own shape counts, which a parabola misses.
TEST(NearCurves, FollowSkewedCurves) {
  const auto mtf = [](double z) {
    const double s = z / 0.03;
    return std::exp(-0.4 + 0.6 * s - 0.33 * s * s + 0.1 * s * s * s - 0.02 * s * s * s * s);
  };
  std::vector<Channel> channels(1, Channel{{0.1, 0.1}, {}});
  for (const double z : {-0.06, -0.03, -0.015, -0.005, 0.005, 0.015, 0.03, 0.06})
    channels[0].samples.push_back({{z, 0, 0}, mtf(z)});
  ASSERT_EQ(fit_near(channels, {0, 0, 0}, 0.03), 1);
  for (double z = -0.02; z <= 0.02; z += 0.002) EXPECT_NEAR(channels[0].near->at(z), mtf(z), 0.006) << z;
  ASSERT_EQ(fit(channels, 0.03), 1);
  double worst = 0;
  for (double z = -0.02; z <= 0.02; z += 0.002) worst = std::max(worst, std::fabs(channels[0].curve->at(z) - mtf(z)));
  EXPECT_GT(worst, 0.03);
}

// With noise of captures: 0.0125 in each of seven near the solution leave 0.006 there.
TEST(NearCurves, AverageNoise) {
  const Lens lens;
  relign::Random noise(7);
  double squares = 0;
  constexpr int kDraws = 200;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<Channel> channels(1, Channel{{0.1, 0.1}, {}});
    for (const double z : {-0.06, 0.0, 0.06, -0.015, -0.005, 0.005, 0.015, -0.012, -0.008, -0.004})
      channels[0].samples.push_back({{z, 0, 0}, Curve{std::log(0.8), 0.03, 0.035}.at(z) + 0.0125 * noise.normal()});
    fit_near(channels, {0, 0, 0}, 0.03);
    squares += std::pow(channels[0].near->at(0) - Curve{std::log(0.8), 0.03, 0.035}.at(0), 2);
  }
  EXPECT_LT(std::sqrt(squares / kDraws), 0.007);
}

// With play, what is captured after a move down was a little beside its pose.
TEST(NearCurves, CountDoubtfulSamplesLess) {
  const auto error = [](double doubt) {
    const Curve curve{std::log(0.8), 0.03, 0.035};
    std::vector<Channel> channels(1, Channel{{0.1, 0.1}, {}});
    for (const double z : {0.0, -0.015, -0.005, 0.005, 0.015}) channels[0].samples.push_back({{z, 0, 0}, curve.at(z)});
    channels[0].samples.push_back({{-0.01, 0, 0}, curve.at(-0.007), doubt});
    fit_near(channels, {0, 0, 0}, 0.03);
    return std::fabs(channels[0].near->at(-0.01) - curve.at(-0.01));
  };
  EXPECT_LT(error(0.05), 0.5 * error(0));
}

TEST(NearCurves, NeedTwoSamplesInTheLight) {
  std::vector<Channel> channels(1, Channel{{0.1, 0.1}, {}});
  channels[0].samples = {{Focus(0, 0, 0), 0.5}, {Focus(0.1, 0, 0), 0.05}};
  EXPECT_EQ(fit_near(channels, {0, 0, 0}, 0.03), 0);
  EXPECT_FALSE(channels[0].near);
}

// Curves that lean to one side, as those of lenses with spherical aberration do, with a reversed contrast far away.
double leaning(double away) {
  if (std::fabs(away) > 0.1) return std::log(0.3);
  return std::log(0.8) - 0.5 * std::pow(away / 0.05, 2) + 0.2 * std::pow(away / 0.05, 3);
}

std::vector<DesignCurve> leaning_design(const Lens& lens, const std::vector<Channel>& channels) {
  std::vector<DesignCurve> design;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const double best = lens.centre(i, channels[i]) - channels[i].defocus(lens.optimum);
    std::vector<double> table;
    for (int k = -50; k <= 50; ++k) table.push_back(leaning(0.003 * k - best));
    design.emplace_back(-0.15, 0.003, std::move(table));
  }
  return design;
}

TEST(DesignCurve, IsReadBetweenItsValues) {
  std::vector<double> table;
  for (int k = 0; k <= 40; ++k) table.push_back(leaning(-0.0614 + 0.003 * k));
  const DesignCurve curve(1, 0.003, table);
  EXPECT_NEAR(curve.best(), 1.0614, 1e-4) << "a thirtieth of the table's stride";
  for (const double away : {-0.05, -0.011, 0.0, 0.0007, 0.04}) {
    EXPECT_NEAR(curve.at(away), leaning(away), 1e-3) << away;
    EXPECT_NEAR(curve.slope(away), (leaning(away + 1e-5) - leaning(away - 1e-5)) / 2e-5, 0.02) << away;
  }
  EXPECT_NEAR(curve.at(-1), table.front(), 1e-12);
  EXPECT_NEAR(curve.at(1), table.back(), 1e-12);
}

// Parabolas miss the plane of leaning curves; those of the design find it, from a start that is a third of a width off.
TEST(DesignCurve, FindsThePlaneOfLeaningCurves) {
  Lens lens;
  lens.astigmatism = 0.01;
  lens.curvature = 1;
  std::vector<Channel> channels = lens.channels();
  const std::vector<DesignCurve> design = leaning_design(lens, channels);
  relign::Random noise(3);
  for (const double z : {-0.12, -0.06, 0.0, 0.06, 0.12, -0.03, -0.015, 0.015, 0.03})
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const Focus pose = lens.optimum + Focus(z + 0.004, 0.01, 0);
      const double zeta = channels[i].defocus(pose) - lens.centre(i, channels[i]);
      channels[i].samples.push_back({pose, 0.9 * std::exp(leaning(zeta)) + 0.002 * noise.normal()});
    }
  const Focus plane_of_design = plane_of_best_focus([&] {
    std::vector<Channel> at_zero = lens.channels();
    for (std::size_t i = 0; i < design.size(); ++i) at_zero[i].curve = Curve{0, design[i].best(), 1};
    return at_zero;
  }());
  fit(channels, 0.03);
  EXPECT_GT(std::fabs((plane_of_best_focus(channels) - lens.optimum - plane_of_design)[0]), 0.002);
  fit_by_design(channels, design, lens.optimum + Focus(0.015, 0.02, -0.02), 0.03);
  expect_near(plane_of_best_focus(channels), lens.optimum + plane_of_design, 1e-4, 1e-3);
}

TEST(DesignCurve, ChannelWithoutSamplesKeepsTheDesignsFocus) {
  const Lens lens;
  std::vector<Channel> channels = lens.channels();
  fit_by_design(channels, leaning_design(lens, channels), lens.optimum, 0.03);
  expect_near(plane_of_best_focus(channels), lens.optimum, 1e-4, 1e-3);
}

TEST(Marks, FindsSquaresAloneWithTheirCentres) {
  constexpr std::size_t kWidth = 120, kHeight = 80;
  std::vector<float> pixels(kWidth * kHeight, 1.0F);
  const auto dark = [&](std::size_t x, std::size_t y, std::size_t columns, std::size_t rows) {
    for (std::size_t row = y; row < y + rows; ++row)
      for (std::size_t column = x; column < x + columns; ++column) pixels[row * kWidth + column] = 0;
  };
  dark(20, 30, 21, 19);                      // a mark
  dark(70, 20, 3, 31), dark(56, 34, 31, 3);  // a cross
  dark(0, 0, 15, 15);                        // at the border
  dark(100, 60, 4, 4);                       // too small
  const std::vector<Mark> marks = find_marks(pixels, kWidth, kHeight);
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_DOUBLE_EQ(marks[0].x_px, 30);
  EXPECT_DOUBLE_EQ(marks[0].y_px, 39);
  EXPECT_EQ(nearest(marks, 33, 43, 6), marks.data());
  EXPECT_EQ(nearest(marks, 33, 43, 4), nullptr);
}

// Where MTF changes evenly over the image, the mean of both edges is that at the mark's middle; the edge nearer to the
// centre alone is off by the change over half a side.
TEST(Marks, HaveEdgesOnBothSidesOfTheirMiddle) {
  const Mark mark{1720.4, 1100.7, 140}, place{1728, 1152, 140};
  for (const bool upright : {true, false}) {
    const std::vector<Region> edges = edges_of(mark, place, upright, 10, 1920, 1280);
    ASSERT_EQ(edges.size(), 2u);
    double x = 0, y = 0;
    for (const Region& edge : edges) x += 0.5 * (edge.x + 0.5 * edge.width), y += 0.5 * (edge.y + 0.5 * edge.height);
    EXPECT_NEAR(x, mark.x_px, 1);
    EXPECT_NEAR(y, mark.y_px, 1);
    EXPECT_NEAR(upright ? edges[1].x - edges[0].x : edges[1].y - edges[0].y, 140, 1);
  }
}

TEST(Marks, HaveOneEdgeAtTheBorder) {
  const Mark place{960, 80, 120}, moved{960, 95, 120};
  ASSERT_EQ(edges_of(moved, place, true, 14, 1920, 1280).size(), 2u);
  const std::vector<Region> edges = edges_of(moved, place, false, 14, 1920, 1280);
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_GT(edges[0].y, 95);  // the lower one, also in images where both would fit
}

// Fields of docs/services.md: centre, 0.8 of the way to sides and corners, 0.45 to the corners.
TEST(Marks, AreInTheCentreInACornerOrElsewhere) {
  const auto part = [](double u, double v) { return part_of({960 + 960 * u, 640 + 640 * v, 40}, 960, 640); };
  EXPECT_EQ(part(0, 0), Part::centre);
  EXPECT_EQ(part(0.05, -0.1), Part::centre);
  for (const double u : {-0.8, 0.8}) {
    for (const double v : {-0.8, 0.8}) {
      EXPECT_EQ(part(u, v), Part::corner);
      EXPECT_EQ(part(0.45 / 0.8 * u, 0.45 / 0.8 * v), Part::other);
    }
    EXPECT_EQ(part(u, 0), Part::other);
    EXPECT_EQ(part(0, u), Part::other);
  }
}

}  // namespace
}  // namespace field_focus
