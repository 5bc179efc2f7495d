// The tiles of a frame: squares of pixels that share one importance region B of directions.
//
// For each tile, B is an ellipse of direction cosines that covers every direction which can pass the lens from any
// point of the tile (see optics/passing_table.h). Its centre moves with the position on the sensor, its size does not:
// the number of n uniform directions that fall into B is therefore binomial with the same probability, area / pi,
// everywhere, and the paper's noise can be drawn exactly without tracing directions that cannot pass. Tiles that
// receive no light from the emitter are unlit.
#pragma once

#include <memory>
#include <vector>

#include "base/parallel.h"
#include "imaging/mounted_lens.h"
#include "imaging/scene_file.h"
#include "imaging/tile_steps.h"
#include "optics/backward_path.h"
#include "optics/passing_table.h"
#include "optics/ray_block.h"

namespace relign::imaging {

constexpr int kMaxSamples = 4096;  // directions per pixel

TileGrid tile_grid(const Sensor& sensor);

class PupilTiles {
 public:
  // Both must outlive the tiles.
  PupilTiles(const SceneFile& scene, Parallel& parallel);

  // Fits all tiles to a lens at a pose, at one of its wavelengths (`which` of MountedLens). Does not allocate from the
  // second call on.
  void fit(MountedLens& lens, const optics::Motion& lens_to_world, const optics::BackwardPath& path,
           const std::vector<optics::Op>& ops, const optics::EmitterPlane& emitter, std::size_t which = 0);
  // Of a sensor with windows only the tiles in these.
  const std::vector<Tile>& tiles() const { return tiles_; }

  // Restricts fit, from now on, to the tiles that have pixels of these boxes; empty: all tiles.
  void select(const std::vector<PixelBox>& boxes);
  // Places of the selected tiles in tiles(). Only they fit the latest pose.
  const std::vector<std::size_t>& selected() const { return selected_; }

 private:
  void fill_table(MountedLens& lens, std::size_t which, const optics::Motion& lens_to_world);
  // Fits one row of corners.
  void fit_corners(int row, const optics::Motion& lens_to_world);
  void probe_emitter(int row, const optics::BackwardPath& path, const std::vector<optics::Op>& ops,
                     const optics::EmitterPlane& emitter, optics::RayBlock& block);
  Lighting find_unlit_tiles(double half_emitter);

  // A tile's place in the grid.
  struct Cell {
    int column = 0, row = 0;
  };
  Cell cell_of(const Tile& tile) const {
    return {tile.box.column / grid_.tile_pixels, tile.box.row / grid_.tile_pixels};
  }
  std::size_t corner_at(int column, int row) const { return static_cast<std::size_t>(grid_.corner_at(column, row)); }
  TileCorners corners_of(const Tile& tile) const {
    return imaging::corners_of(grid_, corners_.data(), cell_of(tile).column, cell_of(tile).row);
  }

  const optics::PassingTable* table_ = nullptr;  // of the current lens
  Parallel* parallel_;
  TileGrid grid_;
  std::vector<TileCorner> corners_;
  std::vector<char> is_used_;        // per corner: of a selected tile, or of one beside it
  std::vector<char> used_for_all_;   // the same if all tiles are selected
  std::vector<int> place_in_tiles_;  // per tile of the grid; -1: none
  std::vector<std::size_t> selected_;
  bool selects_all_ = true;
  std::vector<Tile> tiles_;
  std::vector<Cell> around_;                               // of the grid: the tiles and those beside them
  std::vector<int> missing_;                               // in the table
  std::vector<Visibility> visibilities_;                   // one per tile of the grid
  std::vector<std::unique_ptr<optics::RayBlock>> blocks_;  // one per thread
};

}  // namespace relign::imaging
