// The tiles of a frame: squares of pixels that share one region B of directions to sample.
//
// For each tile B is an ellipse of direction cosines that covers every direction which can pass the
// lens from any place of the tile (see optics/passing_table.h). Its centre moves with the place on
// the sensor, its size does not: so the number of uniform directions out of n that fall into B is
// binomial with one probability, area / pi, for all places, and the paper's noise can be drawn
// exactly without tracing the directions that cannot pass. Tiles that see nothing of the emitter
// are blind.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "imaging/scene_file.h"
#include "optics/backward_path.h"
#include "optics/passing_table.h"
#include "optics/ray_block.h"

namespace relign::imaging {

constexpr int kTilePixels = 12;     // a side, at most
constexpr int kMostSamples = 4096;  // directions a pixel

struct Tile {
  int column = 0, row = 0;  // first pixel
  int columns = 0, rows = 0;
  bool blind = true;
  bool whole_disc = false;  // B would leave the unit disc: directions are drawn from all of it
  double area = 0;          // of B, direction cosines squared
  optics::TileStart start{};
};

// Where a tile's rays start: pixel pitch, and the way from the sensor to the path's first frame.
void set_places(optics::TileStart& start, const SceneFile& scene, const Tile& tile, const optics::BackwardPath& path);

class PupilTiles {
 public:
  PupilTiles(const SceneFile& scene, const optics::PassingTable& table);

  // Fits all tiles to a pose; no allocation after the first call.
  void fit(const optics::Motion& lens_to_world, const optics::BackwardPath& path, const std::vector<optics::Op>& ops,
           const optics::EmitterPlane& emitter);
  const std::vector<Tile>& tiles() const { return tiles_; }

 private:
  // What is known at one corner of tiles.
  struct Corner {
    bool empty = true;
    double p[optics::kSupports], q[optics::kSupports];  // vertices of the polygon of passing directions
    double centre_p = 0, centre_q = 0;
    // Where probing rays met the emitter's plane; count 0: none arrived.
    int hits = 0;
    double low_x = 0, high_x = 0, low_y = 0, high_y = 0;
  };

  void fit_corners(const optics::Motion& lens_to_world);
  void probe_emitter(const optics::BackwardPath& path, const std::vector<optics::Op>& ops,
                     const optics::EmitterPlane& emitter);
  enum class Sight { emitter, nothing, unknown };
  Sight sight(const Tile& tile, double half_emitter) const;
  void find_blind_tiles(double half_emitter);
  void fit_tile(Tile& tile, const optics::BackwardPath& path) const;
  std::array<const Corner*, 4> corners_of(const Tile& tile) const;  // left and right above, then below
  optics::Vec3 corner_place(int tile_column, int tile_row) const;

  const SceneFile* scene_;
  const optics::PassingTable* table_;
  int tile_pixels_;  // a side; fewer than kTilePixels when the sensor has few
  int across_;       // tiles a side
  std::vector<Corner> corners_;
  std::vector<Tile> tiles_;
  std::vector<Sight> sights_;  // one a tile
  std::unique_ptr<optics::RayBlock> block_;
};

}  // namespace relign::imaging
