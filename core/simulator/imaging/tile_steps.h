// The arithmetic of tiles (pupil_tiles.h), for CPU and GPU: the directions that pass at their corners, where probe rays
// meet the emitter's plane, which pixels can be lit, and the region B of a tile. NVRTC compiles this header.
//
// Margins that are too small lose light, which a scene's certificate (certificate.h) finds; too large ones only cost
// time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "imaging/pixel_grid.h"
#include "optics/passing_steps.h"
#include "optics/pi.h"
#include "optics/tile_start.h"

namespace relign::imaging {

constexpr double kMaxSine = 0.999;  // of directions against the axis

inline double length(double a, double b) { return std::sqrt(a * a + b * b); }

constexpr int kTilePixels = 12;                     // per side, at most
constexpr int kProbes = 1 + optics::kSupports / 2;  // probe rays from each corner of tiles to the emitter

// How a sensor is divided into tiles.
struct TileGrid {
  PixelGrid sensor;
  int tile_pixels = 0;       // a side; fewer than kTilePixels when the sensor has few
  int across = 0, down = 0;  // tiles
  int tiles() const { return across * down; }
  int corners() const { return (across + 1) * (down + 1); }

  PixelBox box(int column, int row) const {
    return {column * tile_pixels, row * tile_pixels, std::min(tile_pixels, sensor.width - column * tile_pixels),
            std::min(tile_pixels, sensor.height - row * tile_pixels)};
  }
  int corner_at(int column, int row) const { return row * (across + 1) + column; }
  optics::Vec3 corner_place(int column, int row) const {
    return sensor.place(std::min(column * tile_pixels, sensor.width), std::min(row * tile_pixels, sensor.height));
  }
};

struct Tile {
  PixelBox box;
  PixelBox lit;  // contains every pixel of `box` that the emitter can light; undefined in unlit tiles
  bool unlit = true;
  bool whole_disc = false;  // B would leave the unit disc: directions are drawn from the whole disc
  double area = 0;          // of B, direction cosines squared
  optics::TileStart start{};
};

// Results at one corner of tiles.
struct TileCorner {
  bool empty = true;
  double p[2 * optics::kSupports], q[2 * optics::kSupports];  // vertices of the polygon of passing directions
  double centre_p = 0, centre_q = 0;
  // Hits of the probe rays on the emitter's plane.
  bool hit[kProbes] = {};
  double hit_x[kProbes], hit_y[kProbes];

  bool lost_probes() const {
    int hits = 0;
    for (const bool one : hit) hits += one ? 1 : 0;
    return hits < kProbes;
  }
};

using TileCorners = std::array<const TileCorner*, 4>;  // left and right above, then below

inline TileCorners corners_of(const TileGrid& tiles, const TileCorner* corners, int column, int row) {
  const auto corner = [&](int c, int r) { return corners + tiles.corner_at(c, r); };
  return {corner(column, row), corner(column + 1, row), corner(column, row + 1), corner(column + 1, row + 1)};
}

// Sets where a tile's rays start: pixel pitch, and the motion from the sensor to the path's first frame.
inline void set_places(optics::TileStart& start, const PixelGrid& sensor, const PixelBox& tile,
                       const optics::Motion& into_first_frame) {
  start.pixel_pitch_x = static_cast<float>(sensor.pitch_mm);
  start.pixel_pitch_y = static_cast<float>(-sensor.pitch_mm);
  optics::set_first_frame(start, into_first_frame, middle_of(sensor, tile));
}

// The pixels `part` of a tile.
inline optics::PixelPlaces places_of(const PixelBox& tile, const PixelBox& part, int frame_width) {
  const auto width = static_cast<std::uint32_t>(frame_width);
  return {part.columns, static_cast<float>(part.column - tile.column) - 0.5F * static_cast<float>(tile.columns),
          static_cast<float>(part.row - tile.row) - 0.5F * static_cast<float>(tile.rows),
          static_cast<std::uint32_t>(part.row) * width + static_cast<std::uint32_t>(part.column), width};
}

// ---- Corners ----

// Borders of regions of direction cosines: from azimuth to azimuth of twice as many as there are supports.
constexpr double kBetweenAzimuths = 1.005;  // 1 / cos(pi / 32)
constexpr double kLongestReach = 2;         // the diameter of the disc
constexpr double kParallelSupport = 1e-6;   // a cosine: such support lines do not cut the azimuth
constexpr double kTiny = 1e-12;             // instead of dividing by 0

// Directions (of any length) whose hull contains a region on a plane: from `place` to the intersections of support
// lines k and k + 1.
inline optics::Vec3 direction_on_plane(const optics::PassingRegion& region, const optics::Azimuths& azimuths,
                                       const optics::Vec3& place, double plane_z, int k) {
  const double one_step = azimuths.sine[2];  // of the angle between supports
  const int next = (k + 1) % optics::kSupports;
  const double ax = azimuths.cosine[2 * k], ay = azimuths.sine[2 * k];
  const double bx = azimuths.cosine[2 * next], by = azimuths.sine[2 * next];
  const double ha = region.supports[k], hb = region.supports[next];
  const double dx = region.middle[0] + (ha * by - hb * ay) / one_step - place.x;
  const double dy = region.middle[1] + (hb * ax - ha * bx) / one_step - place.y;
  return {dx, dy, plane_z - place.z};
}

// The same for a region of direction cosines. Supports widened one by one need not describe a convex region: the border
// is where the first support line cuts each of twice as many azimuths, plus a margin for directions in between.
inline optics::Vec3 direction_of_cosines(const optics::PassingRegion& region, const optics::Azimuths& azimuths, int k) {
  const double cosine = azimuths.cosine[k], sine = azimuths.sine[k];
  double reach = kLongestReach;
  for (int j = 0; j < optics::kSupports; ++j) {
    const double along = cosine * azimuths.cosine[2 * j] + sine * azimuths.sine[2 * j];
    if (along > kParallelSupport) reach = std::min(reach, region.supports[j] / along);
  }
  double a = region.middle[0] + kBetweenAzimuths * reach * cosine,
         b = region.middle[1] + kBetweenAzimuths * reach * sine;
  const double shrink = std::min(1.0, kMaxSine / std::max(length(a, b), kTiny));
  a *= shrink;
  b *= shrink;
  return {a, b, -std::sqrt(1 - a * a - b * b)};
}

// Of a corner's polygon.
inline int polygon_points(const optics::PassingGrid& grid) {
  return grid.on_plane ? optics::kSupports : 2 * optics::kSupports;
}

// Sets all of a corner but the hits, of which it has none. `place`: of the corner in lens coordinates.
inline void fit_corner(const optics::PassingGrid& grid, const optics::PassingRegion* regions,
                       const optics::Azimuths& azimuths, const optics::Rotation& lens_to_world,
                       const optics::Vec3& place, TileCorner& corner) {
  const optics::PassingRegion region = optics::region_at(grid, regions, place);
  corner.empty = region.empty;
  for (bool& one : corner.hit) one = false;
  corner.centre_p = corner.centre_q = 0;
  if (region.empty) return;
  const optics::Rotation& r = lens_to_world;
  const int points = polygon_points(grid);
  for (int k = 0; k < points; ++k) {
    const optics::Vec3 d = grid.on_plane ? direction_on_plane(region, azimuths, place, grid.plane_z, k)
                                         : direction_of_cosines(region, azimuths, k);
    const double scale = 1 / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
    corner.p[k] = (r[0] * d.x + r[1] * d.y + r[2] * d.z) * scale;
    corner.q[k] = (r[3] * d.x + r[4] * d.y + r[5] * d.z) * scale;
  }
  for (int k = 0; k < points; ++k) {
    corner.centre_p += corner.p[k] / points;
    corner.centre_q += corner.q[k] / points;
  }
}

// The direction (world) of one of the probe rays of a corner through which light passes; false if there is none.
inline bool probe_direction(const TileCorner& corner, int points, int probe, optics::Vec3& direction) {
  constexpr double kProbeScale = 0.9;  // of the polygon: probe rays stay inside the passing region
  double p = corner.centre_p, q = corner.centre_q;
  if (probe > 0) {
    const int point = points / (kProbes - 1) * (probe - 1);
    p += kProbeScale * (corner.p[point] - p);
    q += kProbeScale * (corner.q[point] - q);
  }
  const double rest = 1 - p * p - q * q;
  if (!(rest > 0)) return false;
  direction = {p, q, -std::sqrt(rest)};
  return true;
}

inline void add_hit(TileCorner& corner, int probe, double x, double y) {
  corner.hit[probe] = true;
  corner.hit_x[probe] = x;
  corner.hit_y[probe] = y;
}

// ---- What the emitter can light ----

// Where light can meet the emitter: the hull of the hits of probe rays, which stay inside the passing region, is
// widened by a share of its own size, of the emitter's side, and of the blur, the spread of one corner's probe rays.
// Defocus and low-order aberrations can be extrapolated beyond the probe rays, the high-order aberrations of a strong
// blur cannot.
constexpr double kHullWidening = 0.15;      // of the hull's own size, on each side
constexpr double kHullMarginShare = 0.005;  // of the emitter's side
constexpr double kSteepMarginShare = 0.1;   // the same for regions in direction cosines: strong aspheres
constexpr double kBlurWidening = 0.2;       // of the blur
constexpr double kStrongBlurWidening = 0.75;
constexpr double kLostBlurWidening = 0.3;  // if some probe rays were lost
constexpr double kLostStrongBlurWidening = 1;
constexpr double kStrongBlur = 0.1;   // of the emitter's side
constexpr double kBlurryShare = 0.3;  // of the emitter's side: a blur that can carry light anywhere
constexpr double kAnywhere = 1e300;   // mm: farther than any ray goes

// Bounding box of hits on the emitter's plane.
struct Hull {
  int hits = 0;
  double low_x = kAnywhere, high_x = -kAnywhere, low_y = kAnywhere, high_y = -kAnywhere;

  void add(double x, double y) {
    ++hits;
    low_x = std::min(low_x, x);
    high_x = std::max(high_x, x);
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
  }
  void add(const TileCorner& corner) {
    for (int probe = 0; probe < kProbes; ++probe)
      if (corner.hit[probe]) add(corner.hit_x[probe], corner.hit_y[probe]);
  }
  // Widened for rays between the probe rays, and by the blur: aberrations send rays at the rim of the region farther
  // out than the probe rays, which stay inside it.
  bool misses(double half_emitter, double blur_margin) const {
    const double margin = kHullMarginShare * 2 * half_emitter + blur_margin;
    const double wide_x = kHullWidening * (high_x - low_x) + margin, wide_y = kHullWidening * (high_y - low_y) + margin;
    return low_x - wide_x > half_emitter || high_x + wide_x < -half_emitter || low_y - wide_y > half_emitter ||
           high_y + wide_y < -half_emitter;
  }
  bool is_inside(double half_emitter) const {
    return low_x > -half_emitter && high_x < half_emitter && low_y > -half_emitter && high_y < half_emitter;
  }
};

inline Hull hull_of(const TileCorners& corners) {
  Hull hull;
  for (const TileCorner* corner : corners) hull.add(*corner);
  return hull;
}

// The spread of the probe rays of a corner; 0 if all of them miss the emitter.
inline double blur(const TileCorner& corner, double half_emitter) {
  Hull hull;
  hull.add(corner);
  bool lit = false;
  for (int probe = 0; probe < kProbes; ++probe)
    lit |= corner.hit[probe] && std::fabs(corner.hit_x[probe]) < half_emitter &&
           std::fabs(corner.hit_y[probe]) < half_emitter;
  return lit ? std::max(hull.high_x - hull.low_x, hull.high_y - hull.low_y) : 0;
}

// Whether hits spread over a large part of the emitter.
inline bool is_blurry(const TileCorner& corner, double half_emitter) {
  return blur(corner, half_emitter) > kBlurryShare * 2 * half_emitter;
}

// What tiles are compared with.
struct Lighting {
  double half_emitter = 0;  // mm
  bool on_plane = true;     // regions
  bool blurry = false;      // some corner of the image is
};

// What to add to a tile's hulls. Lost probe rays are inconclusive, since rays beside them may arrive.
inline double blur_margin(const TileCorners& corners, const Lighting& lighting) {
  double largest = 0;
  bool lost = false;
  for (const TileCorner* corner : corners) {
    lost |= !corner->empty && corner->lost_probes();
    largest = std::max(largest, blur(*corner, kAnywhere));
  }
  if (lost && lighting.blurry) return kAnywhere;
  const double side = 2 * lighting.half_emitter;
  if (!lighting.on_plane) return lost ? kAnywhere : largest + kSteepMarginShare * side;
  const bool strong = largest > kStrongBlur * side;
  if (lost) return (strong ? kLostStrongBlurWidening : kLostBlurWidening) * largest;
  return (strong ? kStrongBlurWidening : kBlurWidening) * largest;
}

// Whether light passes the lens to any of the corners.
inline bool any_light(const TileCorners& corners) {
  bool passes = false;
  for (const TileCorner* corner : corners) passes |= !corner->empty;
  return passes;
}

enum class Visibility : unsigned char { emitter, nothing, unknown };

inline Visibility visibility(const TileCorners& corners, const Lighting& lighting) {
  const Hull hull = hull_of(corners);
  if (hull.hits == 0) return Visibility::unknown;
  return hull.misses(lighting.half_emitter, blur_margin(corners, lighting)) ? Visibility::nothing : Visibility::emitter;
}

// Of the tiles of the grid, row by row. A tile from whose corners no probe ray passes the whole lens may still receive
// some light of the emitter if a neighbour does, or if the image is very blurred.
inline bool is_unlit(const TileGrid& tiles, const TileCorners& corners, const Visibility* visibilities, int column,
                     int row, bool blurry) {
  const Visibility here = visibilities[row * tiles.across + column];
  if (!any_light(corners) || here == Visibility::nothing) return true;
  if (here == Visibility::emitter || blurry) return false;
  bool neighbour = false;
  for (int r = std::max(0, row - 1); r <= std::min(tiles.down - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(tiles.across - 1, column + 1); ++c)
      neighbour |= visibilities[r * tiles.across + c] == Visibility::emitter;
  return !neighbour;
}

// Where light from the cells of a tile can meet the emitter's plane.
class CellHulls {
 public:
  explicit CellHulls(const PixelBox& box)
      : box_(box),
        columns_((box.columns + kCellPixels - 1) / kCellPixels),
        rows_((box.rows + kCellPixels - 1) / kCellPixels) {}

  // Interpolates the hits of a probe ray bilinearly between the corners, which is accurate enough for culling, since
  // the mapping is smooth over a tile.
  void add(const TileCorners& corners, int probe) {
    const int across = columns_ + 1;
    for (int y = 0; y <= rows_; ++y)
      for (int x = 0; x <= columns_; ++x) {
        const double fx = std::min(1.0, static_cast<double>(x * kCellPixels) / box_.columns);
        const double fy = std::min(1.0, static_cast<double>(y * kCellPixels) / box_.rows);
        const auto between = [&](const double* c0, const double* c1, const double* c2, const double* c3) {
          const double above = (1 - fx) * c0[probe] + fx * c1[probe];
          const double below = (1 - fx) * c2[probe] + fx * c3[probe];
          return (1 - fy) * above + fy * below;
        };
        const int at = y * across + x;
        grid_x_[at] = between(corners[0]->hit_x, corners[1]->hit_x, corners[2]->hit_x, corners[3]->hit_x);
        grid_y_[at] = between(corners[0]->hit_y, corners[1]->hit_y, corners[2]->hit_y, corners[3]->hit_y);
      }
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x)
        for (int corner = 0; corner < 4; ++corner) {
          const int at = (y + corner / 2) * across + x + corner % 2;
          hulls_[y * columns_ + x].add(grid_x_[at], grid_y_[at]);
        }
  }

  // The smallest box of the cells that do not miss the emitter.
  PixelBox lit(double half_emitter, double margin) const {
    int low_x = columns_, high_x = -1, low_y = rows_, high_y = -1;
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) {
        if (hulls_[y * columns_ + x].misses(half_emitter, margin)) continue;
        low_x = std::min(low_x, x);
        high_x = std::max(high_x, x);
        low_y = std::min(low_y, y);
        high_y = std::max(high_y, y);
      }
    if (high_x < 0) return {};
    const int column = low_x * kCellPixels, row = low_y * kCellPixels;
    return {box_.column + column, box_.row + row, std::min((high_x + 1) * kCellPixels, box_.columns) - column,
            std::min((high_y + 1) * kCellPixels, box_.rows) - row};
  }

 private:
  static constexpr int kCellPixels = 3;                             // per side: the resolution of a tile's lit pixels
  static constexpr int kMostCells = kTilePixels / kCellPixels + 1;  // a side
  PixelBox box_;
  int columns_, rows_;
  Hull hulls_[kMostCells * kMostCells];
  double grid_x_[(kMostCells + 1) * (kMostCells + 1)], grid_y_[(kMostCells + 1) * (kMostCells + 1)];  // cells' corners
};

// The pixels of a tile that the emitter can light, from the hits of its corners. A probe that arrives from some corners
// only is inconclusive: then all pixels count as lit.
inline PixelBox lit_pixels(const PixelBox& box, const TileCorners& corners, const Lighting& lighting) {
  const Hull all = hull_of(corners);
  if (all.hits == 0 || all.is_inside(lighting.half_emitter)) return box;
  CellHulls cells(box);
  for (int probe = 0; probe < kProbes; ++probe) {
    int hits = 0;
    for (const TileCorner* corner : corners) hits += corner->hit[probe] ? 1 : 0;
    if (hits > 0 && hits < 4) return box;
    if (hits == 4) cells.add(corners, probe);
  }
  return cells.lit(lighting.half_emitter, blur_margin(corners, lighting));
}

// ---- The region B ----

// Over a tile the centre of B moves linearly: p = centre[0] + slope[0] x + slope[1] y, q likewise with x and y in mm
// from the tile's middle. Without slope if no light passes at some corner.
struct MovingCentre {
  int corners_with_light = 0;
  double half_x = 0, half_y = 0;  // of the tile, mm
  double centre[2] = {0, 0}, slope[4] = {0, 0, 0, 0};
};

inline MovingCentre moving_centre(const TileCorners& corners, double half_x, double half_y) {
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
  const auto set_slope = [&](double c0, double c1, double c2, double c3, double* both) {
    both[0] = (c1 + c3 - c0 - c2) / (4 * half_x);
    both[1] = (c0 + c1 - c2 - c3) / (4 * half_y);
  };
  set_slope(corners[0]->centre_p, corners[1]->centre_p, corners[2]->centre_p, corners[3]->centre_p, moving.slope);
  set_slope(corners[0]->centre_q, corners[1]->centre_q, corners[2]->centre_q, corners[3]->centre_q, moving.slope + 2);
  return moving;
}

// Visits the vertices of the corners' polygons, relative to the moving centre.
template <class Visit>
void each_residual(const TileCorners& corners, int points, const MovingCentre& moving, const Visit& visit) {
  const double at_x[4] = {-moving.half_x, moving.half_x, -moving.half_x, moving.half_x};
  const double at_y[4] = {moving.half_y, moving.half_y, -moving.half_y, -moving.half_y};
  for (int j = 0; j < 4; ++j) {
    if (corners[j]->empty) continue;
    for (int k = 0; k < points; ++k)
      visit(corners[j]->p[k] - (moving.centre[0] + moving.slope[0] * at_x[j] + moving.slope[1] * at_y[j]),
            corners[j]->q[k] - (moving.centre[1] + moving.slope[2] * at_x[j] + moving.slope[3] * at_y[j]));
  }
}

// A triangular matrix that maps the unit disc to the ellipse of the residuals' covariance, scaled until it contains
// them all: {pp, 0, qp, qq}.
inline std::array<double, 4> ellipse_around(const TileCorners& corners, int points, const MovingCentre& moving) {
  constexpr double kAxesMargin = 0.05;         // B's curvature across a tile: the farthest of 2e9 rays was 0.02 outside
  constexpr double kPartlyLitFactor = 1.3;     // no light at some corner: the others alone do not bound the region
  constexpr double kSmallestVariance = 1e-12;  // keeps the ellipse of one point regular
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

// Sets area, whole_disc and start.
inline void fit_region(Tile& tile, const TileCorners& corners, const optics::PassingGrid& grid, const PixelGrid& sensor,
                       const optics::Motion& into_first_frame) {
  using optics::kPi;
  // Directions of B outside the unit disc are lost like others: only a large B is replaced by the whole disc, and on a
  // plane one that reaches the disc's rim.
  constexpr double kLargestShareOfDisc = 0.5;
  const double pitch = sensor.pitch_mm;
  const MovingCentre moving = moving_centre(corners, 0.5 * tile.box.columns * pitch, 0.5 * tile.box.rows * pitch);
  const std::array<double, 4> axes = ellipse_around(corners, polygon_points(grid), moving);
  const double* const slope = moving.slope;
  // Farthest point of B from the disc's centre, at any point of the tile.
  const double reach = length(moving.centre[0], moving.centre[1]) +
                       length(std::fabs(slope[0]) * moving.half_x + std::fabs(slope[1]) * moving.half_y,
                              std::fabs(slope[2]) * moving.half_x + std::fabs(slope[3]) * moving.half_y) +
                       length(axes[0], length(axes[2], axes[3]));
  tile.area = kPi * axes[0] * axes[3];
  tile.whole_disc = tile.area > kLargestShareOfDisc * kPi || (grid.on_plane && !(reach < kMaxSine));
  if (tile.whole_disc) tile.area = kPi;
  optics::TileStart& start = tile.start;
  for (int i = 0; i < 2; ++i) start.centre[i] = static_cast<float>(moving.centre[i]);
  for (int i = 0; i < 4; ++i) {
    start.slope[i] = static_cast<float>(slope[i]);
    start.axes[i] = static_cast<float>(axes[i]);
  }
  set_places(start, sensor, tile.box, into_first_frame);
}

// Fits a lit tile: which of its pixels the emitter can light, and the region B.
inline void fit_tile(Tile& tile, const TileCorners& corners, const optics::PassingGrid& grid, const PixelGrid& sensor,
                     const Lighting& lighting, const optics::Motion& into_first_frame) {
  tile.lit = lit_pixels(tile.box, corners, lighting);
  tile.unlit = tile.lit.columns == 0;
  if (!tile.unlit) fit_region(tile, corners, grid, sensor, into_first_frame);
}

}  // namespace relign::imaging
