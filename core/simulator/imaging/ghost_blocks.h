// Follows the light paths of one box of pixels under transport `ghost` in blocks (optics/ghost_block.h): paths wait in
// queues until a block of them meets the same surface next. One per thread. Internal to imaging; used by
// ghost_image.cpp.
//
// Random numbers come from the number of a block in its box and the ray's place in it; blocks do not depend on the
// instruction set or on threads.
#pragma once

#include <cstdint>
#include <vector>

#include "imaging/ghost_paths.h"
#include "imaging/scene_file.h"
#include "optics/ghost_tables.h"
#include "optics/ray_block.h"

namespace relign::imaging {

// A lens as built at a pose.
struct GhostScene {
  const SceneFile* scene = nullptr;
  double albedo = 0;
  optics::GhostTables tables;
  optics::Op to_world{}, to_print{}, bore{};  // to_print: see Camera::capture
  bool has_bore = false;
  optics::EmitterPlane emitter{};
};

class GhostBlocks {
 public:
  struct Box {
    optics::TileStart start{};  // in lens coordinates
    optics::Vec3 centre;        // on the sensor
    bool hemisphere = false;    // directions from the whole disc
    std::uint64_t seed = 0;
    std::uint32_t number = 0;  // of the box
    std::uint32_t stream = 0;  // of its random numbers
    // Of noise-free images: the irradiances of all pixels without reflections; of captures null.
    const float* straight = nullptr;
  };
  void start(const GhostScene& scene, const Box& box, double* sums);
  // Starts paths from block().u0 to u3 and pixel_x, pixel_y; those of ray i add to sums[owners[i]].
  optics::RayBlock& block() { return block_; }
  void launch(const std::uint32_t* owners, int count);
  void finish();

 private:
  // Always has room for two more blocks.
  struct Queue {
    std::vector<optics::GhostRay> rays;
    int size = 0;
    void push(const optics::GhostRay& ray) { rays[static_cast<std::size_t>(size++)] = ray; }
  };
  Queue& queue(int number) { return queues_[static_cast<std::size_t>(number + 1)]; }
  void make_room();
  void run(int least);
  void distribute(const optics::GhostRay* rays, const std::int32_t* to, int count);
  void launch_as(bool hemisphere, const optics::GhostRay* from, int count);
  void draw();
  void load(const optics::GhostRay* rays, int count, const optics::Op& motion);
  void reach_emitter(const optics::GhostRay* rays, int count);
  void reach_sensor(const optics::GhostRay* rays, int count);

  const GhostScene* scene_ = nullptr;
  Box box_;
  double* sums_ = nullptr;
  std::uint32_t blocks_ = 0;
  std::vector<Queue> queues_;  // the first is for rays that are gone
  alignas(64) optics::RayBlock block_, words_;
  optics::GhostRay started_[optics::kGhostRays];
  optics::GhostChildren children_;
  std::uint32_t numbers_[optics::kGhostRays], places_[optics::kGhostRays];
  optics::GhostChoice choice_{};  // with the current block's words
};

}  // namespace relign::imaging
