// The tiles of a frame: squares of pixels that share one importance region B of directions.
//
// For each tile, B is an ellipse of direction cosines that covers every direction which can pass the lens from any
// point of the tile (see optics/passing_table.h). Its centre moves with the position on the sensor, its size does not:
// the number of n uniform directions that fall into B is therefore binomial with the same probability, area / pi,
// everywhere, and the paper's noise can be drawn exactly without tracing directions that cannot pass. Tiles that
// receive no light from the emitter are unlit.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "base/parallel.h"
#include "imaging/mounted_lens.h"
#include "imaging/scene_file.h"
#include "optics/backward_path.h"
#include "optics/passing_table.h"
#include "optics/ray_block.h"

namespace relign::imaging {

constexpr double kMaxSine = 0.999;  // of directions against the axis

inline double length(double a, double b) { return std::sqrt(a * a + b * b); }

constexpr int kTilePixels = 12;                     // per side, at most
constexpr int kProbes = 1 + optics::kSupports / 2;  // probe rays from each corner of tiles to the emitter
constexpr int kMaxSamples = 4096;                   // directions per pixel

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
  int hits = 0;
  std::array<bool, kProbes> hit{};
  std::array<double, kProbes> hit_x{}, hit_y{};
};

// Sets where a tile's rays start: pixel pitch, and the motion from the sensor to the path's first frame.
void set_places(optics::TileStart& start, const SceneFile& scene, const PixelBox& tile,
                const optics::BackwardPath& path);

// The pixels `part` of a tile.
optics::PixelPlaces places_of(const PixelBox& tile, const PixelBox& part, int frame_width);

// The sides of a sensor's tiles, in pixels.
int tile_pixels(const Sensor& sensor);

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
  double blur_margin(const std::array<const TileCorner*, 4>& corners, double half_emitter) const;
  enum class Visibility { emitter, nothing, unknown };
  Visibility visibility(const Tile& tile, double half_emitter) const;
  // The pixels of a tile that the emitter can light, from the hits of its corners; all pixels if these are
  // inconclusive.
  PixelBox lit_pixels(const Tile& tile, double half_emitter) const;
  void find_unlit_tiles(double half_emitter);
  void fit_tile(Tile& tile, const optics::BackwardPath& path) const;
  std::array<const TileCorner*, 4> corners_of(const Tile& tile) const;  // left and right above, then below
  optics::Vec3 corner_place(int tile_column, int tile_row) const;

  // A tile's place in the grid.
  struct Cell {
    int column = 0, row = 0;
  };
  Cell cell_of(const Tile& tile) const { return {tile.box.column / tile_pixels_, tile.box.row / tile_pixels_}; }
  std::size_t corner_at(int column, int row) const { return static_cast<std::size_t>(row * (across_ + 1) + column); }

  const SceneFile* scene_;
  const optics::PassingTable* table_ = nullptr;  // of the current lens
  Parallel* parallel_;
  int tile_pixels_;         // a side; fewer than kTilePixels when the sensor has few
  int across_, down_;       // tiles
  std::size_t points_ = 0;  // vertices of each corner's polygon
  std::vector<TileCorner> corners_;
  std::vector<char> is_used_;        // per corner: of a selected tile, or of one beside it
  std::vector<char> used_for_all_;   // the same if all tiles are selected
  std::vector<int> place_in_tiles_;  // per tile of the grid; -1: none
  std::vector<std::size_t> selected_;
  bool selects_all_ = true;
  std::vector<Tile> tiles_;
  std::vector<Tile> around_;                               // of the grid: the tiles and those beside them
  bool blurry_ = false;                                    // hits spread over a large part of the emitter
  std::vector<int> missing_;                               // in the table
  std::vector<Visibility> visibilities_;                   // one per tile of the grid
  std::vector<std::unique_ptr<optics::RayBlock>> blocks_;  // one per thread
};

}  // namespace relign::imaging
