// Tiles of made-up corners, whose hits and directions are known.
#include "imaging/tile_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <relign/random.hpp>
#include <vector>

#include "imaging/pupil_tiles.h"

namespace relign::imaging::tile_steps {
namespace {

Sensor sensor_of(int width, int height) {
  Sensor sensor;
  sensor.width = width;
  sensor.height = height;
  sensor.pitch_mm = 0.01;
  sensor.left_mm = -0.005 * width;
  sensor.top_mm = 0.005 * height;
  return sensor;
}

// Corners from which every probe ray arrives, `magnification` times as far from the axis.
std::vector<TileCorner> sharp_corners(const TileGrid& grid, double magnification) {
  std::vector<TileCorner> corners(static_cast<std::size_t>(grid.corners()));
  for (int row = 0; row <= grid.down; ++row)
    for (int column = 0; column <= grid.across; ++column) {
      TileCorner& corner = corners[static_cast<std::size_t>(grid.corner_at(column, row))];
      corner.empty = false;
      const optics::Vec3 place = grid.corner_place(column, row);
      for (int probe = 0; probe < kProbes; ++probe)
        add_hit(corner, probe, magnification * place.x, magnification * place.y);
    }
  return corners;
}

TEST(TileGrid, CoversEachPixelOnce) {
  for (const auto& [width, height] : {std::pair{200, 200}, {1, 1}, {13, 500}, {1920, 1280}, {145, 143}}) {
    const TileGrid grid = tile_grid(sensor_of(width, height));
    std::vector<int> covered(static_cast<std::size_t>(width * height));
    for (int row = 0; row < grid.down; ++row)
      for (int column = 0; column < grid.across; ++column) {
        const PixelBox box = grid.box(column, row);
        ASSERT_LE(std::max(box.columns, box.rows), kTilePixels);
        for (int y = box.row; y < box.row + box.rows; ++y)
          for (int x = box.column; x < box.column + box.columns; ++x)
            ++covered[static_cast<std::size_t>(y * width + x)];
      }
    EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), width * height) << width << " x " << height;
  }
}

// A sharp image of an emitter that ends within the sensor: no lit pixel is left out, and not many others are kept.
TEST(LitPixels, AreThoseThatMeetTheEmitter) {
  const TileGrid grid = tile_grid(sensor_of(200, 160));
  const std::vector<TileCorner> corners = sharp_corners(grid, -100);
  const Lighting lighting{37.3, true, false};
  std::vector<char> kept(200 * 160, 0);
  for (int row = 0; row < grid.down; ++row)
    for (int column = 0; column < grid.across; ++column) {
      const TileCorners four = corners_of(grid, corners.data(), column, row);
      if (visibility(four, lighting) == Visibility::nothing) continue;
      const PixelBox lit = lit_pixels(grid.box(column, row), four, lighting);
      for (int y = lit.row; y < lit.row + lit.rows; ++y)
        for (int x = lit.column; x < lit.column + lit.columns; ++x) kept[static_cast<std::size_t>(y * 200 + x)] = 1;
    }
  int unneeded = 0;
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 200; ++x) {
      const optics::Vec3 place = grid.sensor.place(x + 0.5, y + 0.5);
      const bool lit = std::fabs(100 * place.x) < 37.3 + 0.5 && std::fabs(100 * place.y) < 37.3 + 0.5;
      const bool is_kept = kept[static_cast<std::size_t>(y * 200 + x)] != 0;
      ASSERT_TRUE(is_kept || !lit) << x << " " << y;
      unneeded += is_kept && !lit ? 1 : 0;
    }
  EXPECT_LT(unneeded, 75 * 75 / 5);
}

TEST(Visibility, IsConcludedFromHitsAlone) {
  const TileGrid grid = tile_grid(sensor_of(144, 144));
  std::vector<TileCorner> corners = sharp_corners(grid, 100);
  const Lighting lighting{20, true, false};
  const auto of = [&](int column, int row, const Lighting& with) {
    return visibility(corners_of(grid, corners.data(), column, row), with);
  };
  EXPECT_EQ(of(6, 6, lighting), Visibility::emitter);
  EXPECT_EQ(of(0, 6, lighting), Visibility::nothing);
  // A lost probe ray may have arrived anywhere if the image is blurry, or if directions are extrapolated.
  corners[static_cast<std::size_t>(grid.corner_at(0, 6))].hit[3] = false;
  EXPECT_EQ(of(0, 6, lighting), Visibility::nothing);
  EXPECT_EQ(of(0, 6, {20, true, true}), Visibility::emitter);
  EXPECT_EQ(of(0, 6, {20, false, false}), Visibility::emitter);
  for (TileCorner& corner : corners)
    for (bool& hit : corner.hit) hit = false;
  EXPECT_EQ(of(6, 6, lighting), Visibility::unknown);
}

TEST(Unlit, NeedsNoNeighbourThatSeesTheEmitter) {
  const TileGrid grid = tile_grid(sensor_of(144, 144));
  std::vector<TileCorner> corners = sharp_corners(grid, 100);
  std::vector<Visibility> seen(static_cast<std::size_t>(grid.tiles()), Visibility::nothing);
  const auto at = [&](int column, int row) -> Visibility& {
    return seen[static_cast<std::size_t>(row * grid.across + column)];
  };
  const auto unlit = [&](int column, int row, bool blurry) {
    return is_unlit(grid, corners_of(grid, corners.data(), column, row), seen.data(), column, row, blurry);
  };
  at(5, 5) = Visibility::emitter;
  at(6, 6) = at(8, 8) = at(0, 11) = Visibility::unknown;
  EXPECT_FALSE(unlit(5, 5, false));
  EXPECT_FALSE(unlit(6, 6, false)) << "beside it";
  EXPECT_TRUE(unlit(8, 8, false));
  EXPECT_TRUE(unlit(0, 11, false)) << "at the sensor's edge";
  EXPECT_FALSE(unlit(8, 8, true));
  EXPECT_TRUE(unlit(4, 4, true)) << "nothing is seen";
  for (TileCorner& corner : corners) corner.empty = true;
  EXPECT_TRUE(unlit(5, 5, true)) << "no light passes the lens";
}

// Directions of a polygon around a centre.
TileCorner corner_around(double p, double q, double size, Random& random) {
  TileCorner corner;
  corner.empty = false;
  for (int k = 0; k < optics::kSupports; ++k) {
    const double angle = 2 * M_PI * k / optics::kSupports, length = size * random.uniform(0.8, 1.2);
    corner.p[k] = p + length * std::cos(angle);
    corner.q[k] = q + length * std::sin(angle);
    corner.centre_p += corner.p[k] / optics::kSupports;
    corner.centre_q += corner.q[k] / optics::kSupports;
  }
  return corner;
}

TEST(FitRegion, HoldsThePolygonsOfAllCorners) {
  Random random(5);
  const PixelGrid sensor = sensor_of(144, 144);
  optics::PassingGrid grid{};
  grid.on_plane = true;
  for (int draw = 0; draw < 200; ++draw) {
    TileCorner four[4];
    for (int k = 0; k < 4; ++k)
      four[k] = corner_around(0.2 + 0.02 * (k % 2) + 0.01 * random.uniform(), -0.1 + 0.02 * (k / 2), 0.15, random);
    const bool partly = draw % 3 == 0;
    four[1].empty = partly;
    Tile tile;
    tile.box = {24, 36, 12, 12};
    fit_region(tile, {&four[0], &four[1], &four[2], &four[3]}, grid, sensor, {});
    ASSERT_FALSE(tile.whole_disc);
    const optics::TileStart& start = tile.start;
    EXPECT_NEAR(tile.area, M_PI * static_cast<double>(start.axes[0]) * static_cast<double>(start.axes[3]), 1e-6);
    for (int k = 0; k < 4; ++k) {
      if (four[k].empty) continue;
      const double x = k % 2 == 0 ? -0.06 : 0.06, y = k / 2 == 0 ? 0.06 : -0.06;
      double farthest = 0;
      for (int i = 0; i < optics::kSupports; ++i) {
        const double dp =
            four[k].p[i] - (static_cast<double>(start.centre[0]) + static_cast<double>(start.slope[0]) * x +
                            static_cast<double>(start.slope[1]) * y);
        const double dq =
            four[k].q[i] - (static_cast<double>(start.centre[1]) + static_cast<double>(start.slope[2]) * x +
                            static_cast<double>(start.slope[3]) * y);
        const double a = dp / static_cast<double>(start.axes[0]);
        const double b = (dq - static_cast<double>(start.axes[2]) * a) / static_cast<double>(start.axes[3]);
        farthest = std::max(farthest, std::hypot(a, b));
      }
      EXPECT_LT(farthest, 1 / 1.049) << draw;
    }
  }
}

TEST(FitRegion, DrawsFromTheWholeDiscWhereItWouldLeaveTheDisc) {
  Random random(6);
  TileCorner four[4];
  for (TileCorner& corner : four) corner = corner_around(0.8, 0, 0.3, random);
  optics::PassingGrid grid{};
  Tile tile;
  tile.box = {0, 0, 12, 12};
  grid.on_plane = true;
  fit_region(tile, {&four[0], &four[1], &four[2], &four[3]}, grid, sensor_of(144, 144), {});
  EXPECT_TRUE(tile.whole_disc);
  EXPECT_DOUBLE_EQ(tile.area, M_PI);
}

}  // namespace
}  // namespace relign::imaging::tile_steps
