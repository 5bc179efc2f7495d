#include "imaging/pupil_tiles.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace relign::imaging {
namespace {

using optics::kBlockRays;
using optics::kPi;
using optics::kSupports;
using optics::Vec3;

// The constants of this file; those of the region B are in tile_region.cpp. Margins that are too small lose light,
// which a scene's certificate (certificate.h) finds; too large ones only cost time.

// Tiles are small compared with the image, whatever its resolution, so that corners represent what is between them.
constexpr int kMinTilesAcross = 12;
constexpr int kCellPixels = 3;  // per side: the resolution of a tile's lit pixels

// Borders of regions of direction cosines: from azimuth to azimuth of twice as many as there are supports.
constexpr double kBetweenAzimuths = 1.005;  // 1 / cos(pi / 32)
constexpr double kLongestReach = 2;         // the diameter of the disc
constexpr double kParallelSupport = 1e-6;   // a cosine: such support lines do not cut the azimuth
constexpr double kTiny = 1e-12;             // instead of dividing by 0

// Where light can meet the emitter: the hull of the hits of probe rays, which stay inside the passing region, is
// widened by a share of its own size, of the emitter's side, and of the blur, the spread of one corner's probe rays.
// Defocus and low-order aberrations can be extrapolated beyond the probe rays, the high-order aberrations of a strong
// blur cannot.
constexpr double kProbeScale = 0.9;
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

using Corners = std::array<const TileCorner*, 4>;  // left and right above, then below

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
    for (std::size_t probe = 0; probe < kProbes; ++probe)
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

Hull hull_of(const Corners& corners) {
  Hull hull;
  for (const TileCorner* corner : corners) hull.add(*corner);
  return hull;
}

// The spread of the probe rays of a corner; 0 if all of them miss the emitter.
double blur(const TileCorner& corner, double half_emitter) {
  Hull hull;
  hull.add(corner);
  bool lit = false;
  for (std::size_t probe = 0; probe < kProbes; ++probe)
    lit |= corner.hit[probe] && std::fabs(corner.hit_x[probe]) < half_emitter &&
           std::fabs(corner.hit_y[probe]) < half_emitter;
  return lit ? std::max(hull.high_x - hull.low_x, hull.high_y - hull.low_y) : 0;
}

}  // namespace

void set_places(optics::TileStart& start, const SceneFile& scene, const PixelBox& tile,
                const optics::BackwardPath& path) {
  const Sensor& sensor = scene.sensor;
  start.pixel_pitch_x = static_cast<float>(sensor.pitch_mm);
  start.pixel_pitch_y = static_cast<float>(-sensor.pitch_mm);
  optics::set_first_frame(start, path, sensor.place(tile.column + 0.5 * tile.columns, tile.row + 0.5 * tile.rows));
}

optics::PixelPlaces places_of(const PixelBox& tile, const PixelBox& part, int frame_width) {
  const auto width = static_cast<std::uint32_t>(frame_width);
  return {part.columns, static_cast<float>(part.column - tile.column) - 0.5F * static_cast<float>(tile.columns),
          static_cast<float>(part.row - tile.row) - 0.5F * static_cast<float>(tile.rows),
          static_cast<std::uint32_t>(part.row) * width + static_cast<std::uint32_t>(part.column), width};
}

int tile_pixels(const Sensor& sensor) {
  return std::clamp(std::min(sensor.width, sensor.height) / kMinTilesAcross, 1, kTilePixels);
}

PupilTiles::PupilTiles(const SceneFile& scene, Parallel& parallel) : scene_(&scene), parallel_(&parallel) {
  for (unsigned thread = 0; thread < parallel.threads(); ++thread)
    blocks_.push_back(std::make_unique<optics::RayBlock>());
  const int width = scene.sensor.width, height = scene.sensor.height;
  tile_pixels_ = tile_pixels(scene.sensor);
  across_ = (width + tile_pixels_ - 1) / tile_pixels_;
  down_ = (height + tile_pixels_ - 1) / tile_pixels_;
  corners_.resize(static_cast<std::size_t>((across_ + 1) * (down_ + 1)));
  is_used_.assign(corners_.size(), 0);
  visibilities_.resize(static_cast<std::size_t>(across_ * down_), Visibility::nothing);
  place_in_tiles_.assign(visibilities_.size(), -1);
  // Whether a window has a pixel less than `margin` pixels beside the box.
  const auto in_a_window = [&scene](const PixelBox& box, int margin) {
    const std::vector<PixelBox>& windows = scene.sensor.windows;
    return windows.empty() || std::any_of(windows.begin(), windows.end(), [&](const PixelBox& window) {
             return box.column - margin < window.column + window.columns &&
                    box.column + box.columns + margin > window.column && box.row - margin < window.row + window.rows &&
                    box.row + box.rows + margin > window.row;
           });
  };
  for (int row = 0; row < down_; ++row)
    for (int column = 0; column < across_; ++column) {
      Tile tile;
      tile.box.column = column * tile_pixels_;
      tile.box.row = row * tile_pixels_;
      tile.box.columns = std::min(tile_pixels_, width - tile.box.column);
      tile.box.rows = std::min(tile_pixels_, height - tile.box.row);
      if (in_a_window(tile.box, 0)) {
        place_in_tiles_[static_cast<std::size_t>(row * across_ + column)] = static_cast<int>(tiles_.size());
        selected_.push_back(tiles_.size());
        tiles_.push_back(tile);
      }
      if (!in_a_window(tile.box, tile_pixels_)) continue;
      around_.push_back(tile);
      for (const int across : {column, column + 1})
        for (const int down : {row, row + 1}) is_used_[corner_at(across, down)] = 1;
    }
  used_for_all_ = is_used_;
}

std::array<const TileCorner*, 4> PupilTiles::corners_of(const Tile& tile) const {
  const auto [column, row] = cell_of(tile);
  const auto corner = [&](int c, int r) { return &corners_[corner_at(c, r)]; };
  return {corner(column, row), corner(column + 1, row), corner(column, row + 1), corner(column + 1, row + 1)};
}

Vec3 PupilTiles::corner_place(int tile_column, int tile_row) const {
  const Sensor& sensor = scene_->sensor;
  return sensor.place(std::min(tile_column * tile_pixels_, sensor.width),
                      std::min(tile_row * tile_pixels_, sensor.height));
}

// Computes the regions that this pose needs. Other threads may use the same lens.
void PupilTiles::fill_table(MountedLens& lens, std::size_t which, const optics::Motion& lens_to_world) {
  const std::lock_guard<std::mutex> lock(lens.table_mutex());
  optics::PassingTable& table = lens.table(which);
  table_ = &table;
  points_ = table.search().on_plane() ? kSupports : 2 * kSupports;
  missing_.reserve(table.grid_places());
  missing_.clear();
  const optics::Motion to_lens = optics::inverse(lens_to_world);
  for (int row = 0; row <= down_; ++row)
    for (int column = 0; column <= across_; ++column)
      if (is_used_[corner_at(column, row)]) table.add_missing(to_lens.point(corner_place(column, row)), missing_);
  if (missing_.empty()) return;
  parallel_->for_each(static_cast<int>(missing_.size()), [&](int item, unsigned thread) {
    table.fill(missing_[static_cast<std::size_t>(item)], *blocks_[thread]);
  });
}

namespace {

// Directions (of any length) whose hull contains a region on a plane: from `place` to the intersections of support
// lines k and k + 1.
void directions_on_plane(const optics::PassingRegion& region, const Vec3& place, double plane_z, Vec3* directions) {
  const double one_step = optics::support_direction(1, kSupports)[1];  // sine of the angle between supports
  for (std::size_t k = 0; k < kSupports; ++k) {
    const std::size_t next = (k + 1) % kSupports;
    const auto a = optics::support_direction(static_cast<int>(k), kSupports),
               b = optics::support_direction(static_cast<int>(next), kSupports);
    const double ha = region.supports[k], hb = region.supports[next];
    const double dx = region.middle[0] + (ha * b[1] - hb * a[1]) / one_step - place.x;
    const double dy = region.middle[1] + (hb * a[0] - ha * b[0]) / one_step - place.y;
    const double dz = plane_z - place.z;
    directions[k] = {dx, dy, dz};
  }
}

// The same for a region of direction cosines. Supports widened one by one need not describe a convex region: the border
// is where the first support line cuts each of twice as many azimuths, plus a margin for directions in between.
void directions_of_cosines(const optics::PassingRegion& region, Vec3* directions) {
  constexpr int kAzimuths = 2 * kSupports;
  for (int k = 0; k < kAzimuths; ++k) {
    const auto azimuth = optics::support_direction(k, kAzimuths);
    double reach = kLongestReach;
    for (int j = 0; j < kSupports; ++j) {
      const auto support = optics::support_direction(j, kSupports);
      const double along = azimuth[0] * support[0] + azimuth[1] * support[1];
      if (along > kParallelSupport) reach = std::min(reach, region.supports[static_cast<std::size_t>(j)] / along);
    }
    double a = region.middle[0] + kBetweenAzimuths * reach * azimuth[0],
           b = region.middle[1] + kBetweenAzimuths * reach * azimuth[1];
    const double shrink = std::min(1.0, kMaxSine / std::max(length(a, b), kTiny));
    a *= shrink;
    b *= shrink;
    directions[k] = {a, b, -std::sqrt(1 - a * a - b * b)};
  }
}

}  // namespace

void PupilTiles::fit_corners(int row, const optics::Motion& lens_to_world) {
  const optics::Motion to_lens = optics::inverse(lens_to_world);
  const optics::PupilSearch& search = table_->search();
  std::array<Vec3, 2 * kSupports> directions{};
  for (int column = 0; column <= across_; ++column) {
    if (!is_used_[corner_at(column, row)]) continue;
    TileCorner& corner = corners_[corner_at(column, row)];
    const Vec3 place = to_lens.point(corner_place(column, row));
    const optics::PassingRegion region = table_->at(place);
    corner.empty = region.empty;
    corner.hits = 0;
    corner.hit.fill(false);
    corner.centre_p = corner.centre_q = 0;
    if (region.empty) continue;
    if (search.on_plane())
      directions_on_plane(region, place, search.plane_z(), directions.data());
    else
      directions_of_cosines(region, directions.data());
    const auto& r = lens_to_world.rotation;
    for (std::size_t k = 0; k < points_; ++k) {
      const Vec3& d = directions[k];
      const double scale = 1 / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
      corner.p[k] = (r[0] * d.x + r[1] * d.y + r[2] * d.z) * scale;
      corner.q[k] = (r[3] * d.x + r[4] * d.y + r[5] * d.z) * scale;
    }
    const auto count = static_cast<double>(points_);
    for (std::size_t k = 0; k < points_; ++k) {
      corner.centre_p += corner.p[k] / count;
      corner.centre_q += corner.q[k] / count;
    }
  }
}

namespace {

// Probe rays of many corners in one block of rays.
class ProbeBlock {
 public:
  ProbeBlock(std::vector<TileCorner>& corners, const std::vector<optics::Op>& ops, const optics::EmitterPlane& emitter,
             optics::RayBlock& block)
      : corners_(corners), ops_(ops), emitter_(emitter), block_(block) {}

  void add(std::size_t corner, std::size_t probe, const Vec3& start, const Vec3& direction) {
    rays_[count_] = {corner, probe};
    optics::put_ray(block_, count_, start, direction);
    if (++count_ == kBlockRays) trace();
  }

  // Traces the rays so far and adds their hits to the corners.
  void trace() {
    if (count_ == 0) return;
    const int padded = (count_ + 15) / 16 * 16;
    repeat_last_ray(padded);
    const optics::BlockKernels& kernels = optics::block_kernels();
    kernels.trace(block_, ops_.data(), static_cast<int>(ops_.size()), false, padded);
    kernels.look_up(block_, emitter_, padded);
    for (int i = 0; i < count_; ++i) {
      if (!(block_.margin[i] > 0) || !(block_.lz[i] < 0)) continue;
      const auto [owner, probe] = rays_[i];
      TileCorner& corner = corners_[owner];
      ++corner.hits;
      corner.hit[probe] = true;
      corner.hit_x[probe] = static_cast<double>(block_.x[i]);
      corner.hit_y[probe] = static_cast<double>(block_.y[i]);
    }
    count_ = 0;
  }

 private:
  void repeat_last_ray(int padded) {  // any finite one will do
    const int last = count_ - 1;
    for (int i = count_; i < padded; ++i) {
      for (auto* values : {block_.x, block_.y, block_.z, block_.lx, block_.ly, block_.lz}) values[i] = values[last];
      block_.margin[i] = 1;
    }
  }

  struct Ray {
    std::size_t corner, probe;
  };
  std::vector<TileCorner>& corners_;
  const std::vector<optics::Op>& ops_;
  const optics::EmitterPlane& emitter_;
  optics::RayBlock& block_;
  Ray rays_[kBlockRays];
  int count_ = 0;
};

}  // namespace

void PupilTiles::probe_emitter(int row, const optics::BackwardPath& path, const std::vector<optics::Op>& ops,
                               const optics::EmitterPlane& emitter, optics::RayBlock& block) {
  ProbeBlock rays(corners_, ops, emitter, block);
  for (int column = 0; column <= across_; ++column) {
    const std::size_t owner = corner_at(column, row);
    const TileCorner& corner = corners_[owner];
    if (!is_used_[owner] || corner.empty) continue;
    const Vec3 start = path.into_first_frame.point(corner_place(column, row));
    for (std::size_t probe = 0; probe < kProbes; ++probe) {
      double p = corner.centre_p, q = corner.centre_q;
      if (probe > 0) {
        const std::size_t point = points_ / (kProbes - 1) * (probe - 1);
        p += kProbeScale * (corner.p[point] - p);
        q += kProbeScale * (corner.q[point] - q);
      }
      const double rest = 1 - p * p - q * q;
      if (rest > 0) rays.add(owner, probe, start, path.into_first_frame.direction({p, q, -std::sqrt(rest)}));
    }
  }
  rays.trace();
}

// What to add to a tile's hulls. Lost probe rays are inconclusive, since rays beside them may arrive.
double PupilTiles::blur_margin(const Corners& corners, double half_emitter) const {
  double largest = 0;
  bool lost = false;
  for (const TileCorner* corner : corners) {
    lost |= !corner->empty && corner->hits < kProbes;
    largest = std::max(largest, blur(*corner, kAnywhere));
  }
  if (lost && blurry_) return kAnywhere;
  if (!table_->search().on_plane()) return lost ? kAnywhere : largest + kSteepMarginShare * 2 * half_emitter;
  const bool strong = largest > kStrongBlur * 2 * half_emitter;
  if (lost) return (strong ? kLostStrongBlurWidening : kLostBlurWidening) * largest;
  return (strong ? kStrongBlurWidening : kBlurWidening) * largest;
}

PupilTiles::Visibility PupilTiles::visibility(const Tile& tile, double half_emitter) const {
  const Hull hull = hull_of(corners_of(tile));
  if (hull.hits == 0) return Visibility::unknown;
  return hull.misses(half_emitter, blur_margin(corners_of(tile), half_emitter)) ? Visibility::nothing
                                                                                : Visibility::emitter;
}

namespace {

// Where light from the cells of a tile can meet the emitter's plane.
class CellHulls {
 public:
  explicit CellHulls(const PixelBox& box)
      : box_(box),
        columns_((box.columns + kCellPixels - 1) / kCellPixels),
        rows_((box.rows + kCellPixels - 1) / kCellPixels) {}

  // Interpolates the hits of a probe ray bilinearly between the corners, which is accurate enough for culling, since
  // the mapping is smooth over a tile.
  void add(const Corners& corners, std::size_t probe) {
    const int across = columns_ + 1;
    for (int y = 0; y <= rows_; ++y)
      for (int x = 0; x <= columns_; ++x) {
        const double fx = std::min(1.0, static_cast<double>(x * kCellPixels) / box_.columns);
        const double fy = std::min(1.0, static_cast<double>(y * kCellPixels) / box_.rows);
        const auto between = [&](const std::array<double, kProbes> TileCorner::*member) {
          const double above = (1 - fx) * (corners[0]->*member)[probe] + fx * (corners[1]->*member)[probe];
          const double below = (1 - fx) * (corners[2]->*member)[probe] + fx * (corners[3]->*member)[probe];
          return (1 - fy) * above + fy * below;
        };
        const auto at = static_cast<std::size_t>(y * across + x);
        grid_x_[at] = between(&TileCorner::hit_x);
        grid_y_[at] = between(&TileCorner::hit_y);
      }
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x)
        for (const int at : {y * across + x, y * across + x + 1, (y + 1) * across + x, (y + 1) * across + x + 1})
          hulls_[static_cast<std::size_t>(y * columns_ + x)].add(grid_x_[static_cast<std::size_t>(at)],
                                                                 grid_y_[static_cast<std::size_t>(at)]);
  }

  // The smallest box of the cells that do not miss the emitter.
  PixelBox lit(double half_emitter, double margin) const {
    int low_x = columns_, high_x = -1, low_y = rows_, high_y = -1;
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) {
        if (hulls_[static_cast<std::size_t>(y * columns_ + x)].misses(half_emitter, margin)) continue;
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
  static constexpr std::size_t kMostCells = kTilePixels / kCellPixels + 1;  // a side
  PixelBox box_;
  int columns_, rows_;
  std::array<Hull, kMostCells * kMostCells> hulls_{};
  std::array<double, (kMostCells + 1) * (kMostCells + 1)> grid_x_{}, grid_y_{};  // at the corners of cells
};

}  // namespace

// A probe that arrives from some corners only is inconclusive: then all pixels count as lit.
PixelBox PupilTiles::lit_pixels(const Tile& tile, double half_emitter) const {
  const Corners corners = corners_of(tile);
  const Hull all = hull_of(corners);
  if (all.hits == 0 || all.is_inside(half_emitter)) return tile.box;
  CellHulls cells(tile.box);
  for (std::size_t probe = 0; probe < kProbes; ++probe) {
    const auto hits = std::count_if(corners.begin(), corners.end(), [&](auto* corner) { return corner->hit[probe]; });
    if (hits > 0 && hits < 4) return tile.box;
    if (hits == 4) cells.add(corners, probe);
  }
  return cells.lit(half_emitter, blur_margin(corners, half_emitter));
}

// A tile from whose corners no probe ray passes the whole lens may still receive some light of the emitter if a
// neighbour does, or if the image is very blurred.
void PupilTiles::find_unlit_tiles(double half_emitter) {
  if (!selects_all_) {
    // What the other tiles would show is unknown: nothing is concluded from it, so that more is traced.
    blurry_ = true;
    for (const std::size_t place : selected_) {
      const auto corners = corners_of(tiles_[place]);
      const bool passes = std::any_of(corners.begin(), corners.end(), [](auto* corner) { return !corner->empty; });
      tiles_[place].unlit = !passes || visibility(tiles_[place], half_emitter) == Visibility::nothing;
    }
    return;
  }
  blurry_ = false;
  for (const TileCorner& corner : corners_)
    blurry_ = blurry_ || blur(corner, half_emitter) > kBlurryShare * 2 * half_emitter;
  const auto visibility_at = [this](int column, int row) -> Visibility& {
    return visibilities_[static_cast<std::size_t>(row * across_ + column)];
  };
  for (const Tile& tile : around_)
    visibility_at(cell_of(tile).column, cell_of(tile).row) = visibility(tile, half_emitter);
  for (Tile& tile : tiles_) {
    const auto [column, row] = cell_of(tile);
    bool neighbour = false;
    for (int r = std::max(0, row - 1); r <= std::min(down_ - 1, row + 1); ++r)
      for (int c = std::max(0, column - 1); c <= std::min(across_ - 1, column + 1); ++c)
        neighbour |= visibility_at(c, r) == Visibility::emitter;
    bool passes = false;
    for (const TileCorner* corner : corners_of(tile)) passes |= !corner->empty;
    const Visibility here = visibility_at(column, row);
    tile.unlit = !passes || here == Visibility::nothing || (here == Visibility::unknown && !neighbour && !blurry_);
  }
}

void PupilTiles::fit(MountedLens& lens, const optics::Motion& lens_to_world, const optics::BackwardPath& path,
                     const std::vector<optics::Op>& ops, const optics::EmitterPlane& emitter, std::size_t which) {
  fill_table(lens, which, lens_to_world);
  parallel_->for_each(down_ + 1, [&](int row, unsigned thread) {
    fit_corners(row, lens_to_world);
    probe_emitter(row, path, ops, emitter, *blocks_[thread]);
  });
  find_unlit_tiles(emitter.half_side);
  parallel_->for_each(static_cast<int>(selected_.size()), [&](int index, unsigned) {
    Tile& tile = tiles_[selected_[static_cast<std::size_t>(index)]];
    if (tile.unlit) return;
    tile.lit = lit_pixels(tile, emitter.half_side);
    tile.unlit = tile.lit.columns == 0;
    if (!tile.unlit) fit_tile(tile, path);
  });
}

}  // namespace relign::imaging
