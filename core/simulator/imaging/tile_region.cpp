// The region of the pupil that the rays of a tile aim at.
#include <algorithm>
#include <array>
#include <cmath>

#include "imaging/pupil_tiles.h"

namespace relign::imaging {
namespace {

using optics::kPi;

// The region B around the polygons of a tile's corners, relative to its axes.
constexpr double kAxesMargin = 0.05;         // its curvature across a tile: the farthest of 2e9 rays was 0.02 outside
constexpr double kPartlyLitFactor = 1.3;     // no light at some corner: the others alone do not bound the region
constexpr double kSmallestVariance = 1e-12;  // keeps the ellipse of one point regular
// Directions of B outside the unit disc are lost like others: only a large B is replaced by the whole disc, and on a
// plane one that reaches the disc's rim.
constexpr double kLargestShareOfDisc = 0.5;

using TileCorners = std::array<const TileCorner*, 4>;  // left and right above, then below

// Over a tile the centre of B moves linearly: p = centre[0] + slope[0] x + slope[1] y, q likewise with x and y in mm
// from the tile's middle. Without slope if no light passes at some corner.
struct MovingCentre {
  int corners_with_light = 0;
  double half_x = 0, half_y = 0;  // of the tile, mm
  double centre[2] = {0, 0}, slope[4] = {0, 0, 0, 0};
};

MovingCentre moving_centre(const TileCorners& corners, double half_x, double half_y) {
  MovingCentre moving;
  moving.half_x = half_x;
  moving.half_y = half_y;
  for (const TileCorner* corner : corners) {
    if (corner->empty) continue;
    ++moving.corners_with_light;
    moving.centre[0] += corner->centre_p;
    moving.centre[1] += corner->centre_q;
  }
  for (double& part : moving.centre) part /= moving.corners_with_light;
  if (moving.corners_with_light < 4) return moving;
  const auto set_slope = [&](double TileCorner::*member, double* both) {
    const double c0 = corners[0]->*member, c1 = corners[1]->*member, c2 = corners[2]->*member, c3 = corners[3]->*member;
    both[0] = (c1 + c3 - c0 - c2) / (4 * half_x);
    both[1] = (c0 + c1 - c2 - c3) / (4 * half_y);
  };
  set_slope(&TileCorner::centre_p, moving.slope);
  set_slope(&TileCorner::centre_q, moving.slope + 2);
  return moving;
}

// Visits the vertices of the corners' polygons, relative to the moving centre.
template <class Visit>
void each_residual(const TileCorners& corners, std::size_t points, const MovingCentre& moving, const Visit& visit) {
  const double at_x[4] = {-moving.half_x, moving.half_x, -moving.half_x, moving.half_x};
  const double at_y[4] = {moving.half_y, moving.half_y, -moving.half_y, -moving.half_y};
  for (std::size_t j = 0; j < 4; ++j) {
    if (corners[j]->empty) continue;
    for (std::size_t k = 0; k < points; ++k)
      visit(corners[j]->p[k] - (moving.centre[0] + moving.slope[0] * at_x[j] + moving.slope[1] * at_y[j]),
            corners[j]->q[k] - (moving.centre[1] + moving.slope[2] * at_x[j] + moving.slope[3] * at_y[j]));
  }
}

// A triangular matrix that maps the unit disc to the ellipse of the residuals' covariance, scaled until it contains
// them all: {pp, 0, qp, qq}.
std::array<double, 4> ellipse_around(const TileCorners& corners, std::size_t points, const MovingCentre& moving) {
  double pp = 0, pq = 0, qq = 0;
  each_residual(corners, points, moving, [&](double dp, double dq) {
    pp += dp * dp;
    pq += dp * dq;
    qq += dq * dq;
  });
  const double l00 = std::sqrt(std::max(pp, kSmallestVariance));
  const double l10 = pq / l00;
  const double l11 = std::sqrt(std::max(qq - l10 * l10, kSmallestVariance));
  double largest = 0;
  each_residual(corners, points, moving, [&](double dp, double dq) {
    const double a = dp / l00, b = (dq - l10 * a) / l11;
    largest = std::max(largest, a * a + b * b);
  });
  const double scale =
      std::sqrt(largest) * (1 + kAxesMargin) * (moving.corners_with_light == 4 ? 1.0 : kPartlyLitFactor);
  return {scale * l00, 0, scale * l10, scale * l11};
}

}  // namespace

void PupilTiles::fit_tile(Tile& tile, const optics::BackwardPath& path) const {
  const TileCorners corners = corners_of(tile);
  const double pitch = scene_->sensor.pitch_mm;
  const MovingCentre moving = moving_centre(corners, 0.5 * tile.box.columns * pitch, 0.5 * tile.box.rows * pitch);
  const std::array<double, 4> axes = ellipse_around(corners, points_, moving);
  const auto& [corners_with_light, half_x, half_y, centre, slope] = moving;
  // Farthest point of B from the disc's centre, at any point of the tile.
  const double reach = length(centre[0], centre[1]) +
                       length(std::fabs(slope[0]) * half_x + std::fabs(slope[1]) * half_y,
                              std::fabs(slope[2]) * half_x + std::fabs(slope[3]) * half_y) +
                       length(axes[0], length(axes[2], axes[3]));
  tile.area = kPi * axes[0] * axes[3];
  tile.whole_disc = tile.area > kLargestShareOfDisc * kPi || (table_->search().on_plane() && !(reach < kMaxSine));
  if (tile.whole_disc) tile.area = kPi;
  optics::TileStart& start = tile.start;
  for (int i = 0; i < 2; ++i) start.centre[i] = static_cast<float>(centre[i]);
  for (std::size_t i = 0; i < 4; ++i) {
    start.slope[i] = static_cast<float>(slope[i]);
    start.axes[i] = static_cast<float>(axes[i]);
  }
  set_places(start, *scene_, tile.box, path);
}

}  // namespace relign::imaging
