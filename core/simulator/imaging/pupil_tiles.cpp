#include "imaging/pupil_tiles.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace relign::imaging {

using optics::kBlockRays;
using optics::Vec3;

TileGrid tile_grid(const Sensor& sensor) {
  // Tiles are small compared with the image, whatever its resolution, so that corners represent what is between them.
  constexpr int kMinTilesAcross = 12;
  const int side = std::clamp(std::min(sensor.width, sensor.height) / kMinTilesAcross, 1, kTilePixels);
  return {sensor, side, (sensor.width + side - 1) / side, (sensor.height + side - 1) / side};
}

PupilTiles::PupilTiles(const SceneFile& scene, Parallel& parallel)
    : parallel_(&parallel), grid_(tile_grid(scene.sensor)) {
  for (unsigned thread = 0; thread < parallel.threads(); ++thread)
    blocks_.push_back(std::make_unique<optics::RayBlock>());
  corners_.resize(static_cast<std::size_t>(grid_.corners()));
  is_used_.assign(corners_.size(), 0);
  visibilities_.resize(static_cast<std::size_t>(grid_.tiles()), Visibility::nothing);
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
  for (int row = 0; row < grid_.down; ++row)
    for (int column = 0; column < grid_.across; ++column) {
      Tile tile;
      tile.box = grid_.box(column, row);
      if (in_a_window(tile.box, 0)) {
        place_in_tiles_[static_cast<std::size_t>(row * grid_.across + column)] = static_cast<int>(tiles_.size());
        selected_.push_back(tiles_.size());
        tiles_.push_back(tile);
      }
      if (!in_a_window(tile.box, grid_.tile_pixels)) continue;
      around_.push_back({column, row});
      for (const int across : {column, column + 1})
        for (const int down : {row, row + 1}) is_used_[corner_at(across, down)] = 1;
    }
  used_for_all_ = is_used_;
}

// Computes the regions that this pose needs. Other threads may use the same lens.
void PupilTiles::fill_table(MountedLens& lens, std::size_t which, const optics::Motion& lens_to_world) {
  const std::lock_guard<std::mutex> lock(lens.table_mutex());
  optics::PassingTable& table = lens.table(which);
  table_ = &table;
  missing_.reserve(static_cast<std::size_t>(table.grid().places()));
  missing_.clear();
  const optics::Motion to_lens = optics::inverse(lens_to_world);
  for (int row = 0; row <= grid_.down; ++row)
    for (int column = 0; column <= grid_.across; ++column)
      if (is_used_[corner_at(column, row)]) table.add_missing(to_lens.point(grid_.corner_place(column, row)), missing_);
  if (missing_.empty()) return;
  parallel_->for_each(static_cast<int>(missing_.size()), [&](int item, unsigned thread) {
    table.fill(missing_[static_cast<std::size_t>(item)], *blocks_[thread]);
  });
}

void PupilTiles::fit_corners(int row, const optics::Motion& lens_to_world) {
  const optics::Motion to_lens = optics::inverse(lens_to_world);
  for (int column = 0; column <= grid_.across; ++column)
    if (is_used_[corner_at(column, row)])
      fit_corner(table_->grid(), table_->regions(), optics::azimuths(), lens_to_world.rotation,
                 to_lens.point(grid_.corner_place(column, row)), corners_[corner_at(column, row)]);
}

namespace {

// Probe rays of many corners in one block of rays.
class ProbeBlock {
 public:
  ProbeBlock(std::vector<TileCorner>& corners, const std::vector<optics::Op>& ops, const optics::EmitterPlane& emitter,
             optics::RayBlock& block)
      : corners_(corners), ops_(ops), emitter_(emitter), block_(block) {}

  void add(std::size_t corner, int probe, const Vec3& start, const Vec3& direction) {
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
      add_hit(corners_[owner], probe, static_cast<double>(block_.x[i]), static_cast<double>(block_.y[i]));
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
    std::size_t corner;
    int probe;
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
  const int points = polygon_points(table_->grid());
  for (int column = 0; column <= grid_.across; ++column) {
    const std::size_t owner = corner_at(column, row);
    const TileCorner& corner = corners_[owner];
    if (!is_used_[owner] || corner.empty) continue;
    const Vec3 start = path.into_first_frame.point(grid_.corner_place(column, row));
    Vec3 direction;
    for (int probe = 0; probe < kProbes; ++probe)
      if (probe_direction(corner, points, probe, direction))
        rays.add(owner, probe, start, path.into_first_frame.direction(direction));
  }
  rays.trace();
}

Lighting PupilTiles::find_unlit_tiles(double half_emitter) {
  Lighting lighting{half_emitter, table_->grid().on_plane, false};
  if (!selects_all_) {
    // What the other tiles would show is unknown: nothing is concluded from it, so that more is traced.
    lighting.blurry = true;
    for (const std::size_t place : selected_) {
      const TileCorners corners = corners_of(tiles_[place]);
      tiles_[place].unlit = !any_light(corners) || visibility(corners, lighting) == Visibility::nothing;
    }
    return lighting;
  }
  for (const TileCorner& corner : corners_) lighting.blurry = lighting.blurry || is_blurry(corner, half_emitter);
  for (const Cell& cell : around_)
    visibilities_[static_cast<std::size_t>(cell.row * grid_.across + cell.column)] =
        visibility(imaging::corners_of(grid_, corners_.data(), cell.column, cell.row), lighting);
  for (Tile& tile : tiles_)
    tile.unlit = is_unlit(grid_, corners_of(tile), visibilities_.data(), cell_of(tile).column, cell_of(tile).row,
                          lighting.blurry);
  return lighting;
}

void PupilTiles::fit(MountedLens& lens, const optics::Motion& lens_to_world, const optics::BackwardPath& path,
                     const std::vector<optics::Op>& ops, const optics::EmitterPlane& emitter, std::size_t which) {
  fill_table(lens, which, lens_to_world);
  parallel_->for_each(grid_.down + 1, [&](int row, unsigned thread) {
    fit_corners(row, lens_to_world);
    probe_emitter(row, path, ops, emitter, *blocks_[thread]);
  });
  const Lighting lighting = find_unlit_tiles(static_cast<double>(emitter.half_side));
  parallel_->for_each(static_cast<int>(selected_.size()), [&](int index, unsigned) {
    Tile& tile = tiles_[selected_[static_cast<std::size_t>(index)]];
    if (!tile.unlit) fit_tile(tile, corners_of(tile), table_->grid(), grid_.sensor, lighting, path.into_first_frame);
  });
}

}  // namespace relign::imaging
