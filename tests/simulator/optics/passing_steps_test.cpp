// Importance regions against shapes whose support function is known.
#include "optics/passing_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "optics/passing_table.h"

namespace relign::optics::passing_steps {
namespace {

PassingGrid plane() {
  PassingGrid grid{};
  grid.on_plane = true;
  grid.reach = 2;
  grid.count = 3;
  grid.count_z = 2;
  grid.low = -1;
  grid.step = 1;
  grid.low_z = 4;
  grid.step_z = 0.5;
  return grid;
}

struct Ellipse {
  double x, y, a, b;
  bool contains(double u, double v) const {
    const double s = (u - x) / a, t = (v - y) / b;
    return s * s + t * t < 1;
  }
  // The largest projection on a direction, from a point.
  double support(double cosine, double sine, double from_x, double from_y) const {
    return std::hypot(a * cosine, b * sine) + (x - from_x) * cosine + (y - from_y) * sine;
  }
};

PassingRegion region_of(const Ellipse& shape) {
  RegionSearch work;
  PassingRegion region;
  const auto probe = [&](int count) {
    for (int i = 0; i < count; ++i) work.passed[i] = shape.contains(work.x[i], work.y[i]);
  };
  find_region(OneThread(), plane(), azimuths(), work, probe, region);
  return region;
}

TEST(FindRegion, HasTheSupportsOfAnEllipse) {
  for (const Ellipse& shape : {Ellipse{0, 0, 1, 1}, Ellipse{0.3, -0.2, 1.2, 0.7}, Ellipse{-0.9, 0.8, 0.4, 0.5}}) {
    const PassingRegion region = region_of(shape);
    ASSERT_FALSE(region.empty);
    EXPECT_NEAR(region.middle[0], shape.x, 0.05);
    EXPECT_NEAR(region.middle[1], shape.y, 0.05);
    for (int k = 0; k < kSupports; ++k) {
      const double angle = 2 * M_PI * k / kSupports;
      const double exact = shape.support(std::cos(angle), std::sin(angle), region.middle[0], region.middle[1]);
      const auto at = static_cast<std::size_t>(k);
      EXPECT_GT(region.supports[at], 0.985 * exact) << k;  // of the hull of 32 points of its border
      EXPECT_LT(region.supports[at], exact + 0.005) << k;  // the last step of the bisection
    }
  }
}

TEST(FindRegion, IsEmptyWhereNothingPasses) {
  const PassingRegion region = region_of({0, 0, 0.01, 0.01});  // between the places that are searched
  EXPECT_TRUE(region.empty);
  for (const double support : region.supports) EXPECT_EQ(support, 0);
}

// Regions whose middle and supports are linear in the place.
std::vector<PassingRegion> linear_regions(const PassingGrid& grid) {
  std::vector<PassingRegion> regions(static_cast<std::size_t>(grid.places()));
  for (int i = 0; i < grid.places(); ++i) {
    const Vec3 place = grid.place(i);
    PassingRegion& region = regions[static_cast<std::size_t>(i)];
    region.empty = false;
    region.middle = {0.1 * place.x + 0.2 * place.z, place.y};
    for (std::size_t k = 0; k < kSupports; ++k) region.supports[k] = 1 + 0.1 * place.x - 0.05 * place.y + 0.2 * place.z;
  }
  return regions;
}

TEST(RegionAt, InterpolatesAndWidens) {
  PassingGrid grid = plane();
  const std::vector<PassingRegion> regions = linear_regions(grid);
  const Vec3 place{0.3, -0.6, 4.2};
  const double support = 1 + 0.03 + 0.03 + 0.84;
  const PassingRegion found = region_at(grid, regions.data(), place);
  ASSERT_FALSE(found.empty);
  EXPECT_NEAR(found.middle[0], 0.87, 1e-7);
  EXPECT_NEAR(found.middle[1], -0.6, 1e-7);
  for (const double value : found.supports) EXPECT_NEAR(value, 1.03 * support, 1e-7);
  grid.on_plane = false;  // then by half of what the places around it differ by
  const PassingRegion wider = region_at(grid, regions.data(), place);
  for (const double value : wider.supports) EXPECT_NEAR(value, 1.03 * support + 0.5 * (0.1 + 0.05 + 0.1), 1e-7);
}

TEST(RegionAt, LeavesOutPlacesWithoutLight) {
  const PassingGrid grid = plane();
  std::vector<PassingRegion> regions = linear_regions(grid);
  for (int i = 0; i < grid.places(); ++i)
    if (grid.place(i).x > 0.5) regions[static_cast<std::size_t>(i)] = {};
  const PassingRegion found = region_at(grid, regions.data(), {0.9, 0, 4});
  ASSERT_FALSE(found.empty);
  EXPECT_NEAR(found.middle[0], 0.8, 1e-6) << "that of x = 0";
  for (PassingRegion& region : regions) region = {};
  EXPECT_TRUE(region_at(grid, regions.data(), {0.9, 0, 4}).empty);
}

TEST(RegionAt, IsEmptyOutsideTheRangeAndConstantAboveIt) {
  const PassingGrid grid = plane();
  const std::vector<PassingRegion> regions = linear_regions(grid);
  EXPECT_TRUE(region_at(grid, regions.data(), {1.01, 0, 4.2}).empty);
  EXPECT_TRUE(region_at(grid, regions.data(), {0, -1.01, 4.2}).empty);
  EXPECT_TRUE(region_at(grid, regions.data(), {std::nan(""), 0, 4.2}).empty);
  EXPECT_EQ(region_at(grid, regions.data(), {0, 0, 9}).supports, region_at(grid, regions.data(), {0, 0, 4.5}).supports);
}

}  // namespace
}  // namespace relign::optics::passing_steps
