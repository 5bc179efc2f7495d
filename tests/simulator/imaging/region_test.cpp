// No hemisphere ray outside the importance region B, or in an unlit pixel, ever reaches the emitter.
//
// Traces 10^8 rays over 20 poses and assemblies; RELIGN_REGION_RAYS sets another number.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>

#include "imaging/pupil_tiles.h"
#include "optics/ray_block.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;

struct Count {
  std::uint64_t traced = 0, scored = 0, outside = 0, in_blind_pixels = 0;
  double farthest = 0;
};

// Traces `rays` uniform directions from uniform places of the sensor at one pose.
void trace_hemisphere(const SceneFile& scene, const optics::Assembly& assembly, const std::vector<double>& pose,
                      std::uint64_t rays, std::uint64_t seed, Count& count) {
  // Every place of the emitter counts as lit: white all over.
  Emitter white = scene.emitter;
  white.show(images::Image(2, 2, 1.0F));
  const optics::EmitterPlane emitter = white.plane();
  MountedLens lens(scene, assembly);
  Parallel parallel(1);
  PupilTiles tiles(scene, parallel);
  const optics::Motion lens_to_world = scene.lens_to_world(pose);
  const optics::BackwardPath path = optics::backward_path(assembly, lens_to_world);
  std::vector<optics::Op> ops = path.ops;
  ops.push_back(optics::last_frame_to_world(path));
  tiles.fit(lens, lens_to_world, path, ops, emitter);

  const auto block = std::make_unique<optics::RayBlock>();
  const optics::BlockKernels& kernels = optics::block_kernels();
  std::uint32_t pixel[kBlockRays], sample[kBlockRays];
  const std::uint64_t per_tile = rays / tiles.tiles().size() / kBlockRays + 1;
  std::uint32_t tile_number = 0;
  for (const Tile& tile : tiles.tiles()) {
    optics::TileStart start{};
    const double pitch = scene.sensor.pitch_mm;
    // One "pixel" as large as the tile, so that places are uniform over it.
    start.pixel_pitch_x = static_cast<float>(tile.box.columns * pitch);
    start.pixel_pitch_y = static_cast<float>(-tile.box.rows * pitch);
    optics::set_first_frame(start, path.into_first_frame, middle_of(scene.sensor, tile.box));
    for (int i = 0; i < kBlockRays; ++i) {
      block->pixel_x[i] = -0.5F * start.pixel_pitch_x;
      block->pixel_y[i] = -0.5F * start.pixel_pitch_y;
      pixel[i] = tile_number;
    }
    for (std::uint64_t b = 0; b < per_tile; ++b) {
      for (std::uint32_t i = 0; i < kBlockRays; ++i) sample[i] = static_cast<std::uint32_t>(b) * kBlockRays + i;
      kernels.philox(*block, pixel, sample, 99, static_cast<std::uint32_t>(seed), 1, kBlockRays);
      kernels.start_in_hemisphere(*block, start, kBlockRays);
      kernels.trace(*block, ops.data(), static_cast<int>(ops.size()), false, kBlockRays);
      kernels.look_up(*block, emitter, kBlockRays);
      count.traced += kBlockRays;
      bool any = false;
      for (int i = 0; i < kBlockRays; ++i) any |= block->radiance[i] > 0;
      if (!any) continue;
      // The starts again, in world coordinates: place and direction cosines.
      optics::TileStart world = start;
      for (int k = 0; k < 9; ++k) world.rotation[k] = k % 4 == 0 ? 1.0F : 0.0F;
      for (float& value : world.translation) value = 0;
      const auto starts = std::make_unique<optics::RayBlock>(*block);
      kernels.start_in_hemisphere(*starts, world, kBlockRays);
      for (int i = 0; i < kBlockRays; ++i) {
        if (!(block->radiance[i] > 0)) continue;
        ++count.scored;
        const double column = tile.box.column + (starts->x[i] / start.pixel_pitch_x + 0.5) * tile.box.columns;
        const double row = tile.box.row + (starts->y[i] / start.pixel_pitch_y + 0.5) * tile.box.rows;
        const bool in_seen = column >= tile.lit.column && column <= tile.lit.column + tile.lit.columns &&
                             row >= tile.lit.row && row <= tile.lit.row + tile.lit.rows;
        if (tile.unlit || !in_seen) {
          ++count.in_blind_pixels;
          continue;
        }
        if (tile.whole_disc) continue;
        const optics::TileStart& fit = tile.start;
        const double dp = starts->lx[i] - (fit.centre[0] + fit.slope[0] * starts->x[i] + fit.slope[1] * starts->y[i]);
        const double dq = starts->ly[i] - (fit.centre[1] + fit.slope[2] * starts->x[i] + fit.slope[3] * starts->y[i]);
        const double u = dp / fit.axes[0], v = (dq - fit.axes[2] * u) / fit.axes[3];
        count.farthest = std::max(count.farthest, u * u + v * v);
        if (u * u + v * v > 1) ++count.outside;
      }
    }
    ++tile_number;
  }
}

TEST(Region, ContainsAllLight) {
  std::uint64_t rays = 100'000'000;
  if (const char* wish = std::getenv("RELIGN_REGION_RAYS")) rays = std::strtoull(wish, nullptr, 10);
  Random random(2025);
  Count count;
  for (int draw = 0; draw < 20; ++draw) {
    const optics::Assembly assembly = random_assembly(random);
    const std::vector<double> pose = random_pose(random);
    trace_hemisphere(relign_od_scene(), assembly, pose, rays / 20, static_cast<std::uint64_t>(draw), count);
  }
  EXPECT_GE(count.traced, rays);
  EXPECT_GT(count.scored, count.traced / 200) << "the test sees light";
  EXPECT_EQ(count.outside, 0u) << "of " << count.scored << " rays that score; farthest " << count.farthest;
  RecordProperty("farthest", std::to_string(count.farthest));
  EXPECT_GT(count.farthest, 0.8) << "the region is about as large as what passes";
  EXPECT_EQ(count.in_blind_pixels, 0u);
}

// The corners of the travel, where regions are most distorted.
TEST(Region, ContainsAllLightAtTheEndsOfTheTravel) {
  Random random(7);
  Count count;
  for (int corner = 0; corner < 32; ++corner) {
    std::vector<double> pose(5);
    for (int axis = 0; axis < 5; ++axis) pose[static_cast<std::size_t>(axis)] = corner >> axis & 1;
    trace_hemisphere(relign_od_scene(), random_assembly(random), pose, 400'000, static_cast<std::uint64_t>(corner),
                     count);
  }
  EXPECT_GT(count.scored, 0u);
  EXPECT_EQ(count.outside, 0u) << "of " << count.scored;
  EXPECT_EQ(count.in_blind_pixels, 0u);
}

// Every shipped scene, anywhere in its travel, with its elements off by about what its tolerances allow.
class RegionOfScene : public testing::TestWithParam<std::string> {};

TEST_P(RegionOfScene, ContainsAllLight) {
  std::uint64_t rays = 20'000'000;
  if (const char* wish = std::getenv("RELIGN_REGION_RAYS")) rays = std::strtoull(wish, nullptr, 10);
  const SceneFile scene = read_scene_file(scene_folder() + GetParam() + "/scene.json", {});
  Random random(31);
  Count count;
  for (int draw = 0; draw < 10; ++draw) {
    std::map<std::string, optics::ElementOffset> offsets;
    for (const optics::Element& element : scene.lens.elements)
      offsets[element.name] = {{0.003 * random.normal(), 0.003 * random.normal(), 0.003 * random.normal()},
                               {0.05 * random.normal(), 0.05 * random.normal()}};
    const optics::Assembly assembly(scene.lens, offsets);
    trace_hemisphere(scene, assembly, random_pose(random), rays / 10, static_cast<std::uint64_t>(draw), count);
  }
  EXPECT_GT(count.scored, count.traced / 2000) << "the test sees light";
  EXPECT_EQ(count.outside, 0u) << "of " << count.scored << " rays that score; farthest " << count.farthest;
  EXPECT_EQ(count.in_blind_pixels, 0u) << "of " << count.scored;
}

INSTANTIATE_TEST_SUITE_P(Shipped, RegionOfScene, testing::ValuesIn(shipped_scenes()),
                         [](const auto& scene) { return scene.param; });

// The paper's scene with conics and aspheres in its lens.
TEST(Region, ContainsAllLightOfAspheres) {
  SceneFile scene = relign_od_scene();
  scene.lens.elements[0].faces[1].conic = -0.6;
  scene.lens.elements[1].faces[1].even_asphere = {3e-4, -2e-5, 1e-6};
  scene.lens.elements[3].faces[0].conic = 0.3;
  scene.lens.elements[3].faces[0].even_asphere = {-1e-4, 1e-5};
  Random random(12);
  Count count;
  const optics::Assembly assembly(scene.lens);
  for (int draw = 0; draw < 8; ++draw)
    trace_hemisphere(scene, assembly, random_pose(random), 2'000'000, static_cast<std::uint64_t>(draw), count);
  EXPECT_GT(count.scored, count.traced / 200);
  EXPECT_EQ(count.outside, 0u) << "of " << count.scored << "; farthest " << count.farthest;
  EXPECT_EQ(count.in_blind_pixels, 0u);
}

// B is not too large: most rays drawn from it pass.
TEST(Region, IsTight) {
  Parallel parallel(1);
  const SceneFile& scene = relign_od_scene();
  const optics::Assembly assembly(scene.lens);
  MountedLens lens(scene, assembly);
  PupilTiles tiles(scene, parallel);
  const optics::Motion lens_to_world = scene.lens_to_world(nominal_pose());
  const optics::BackwardPath path = optics::backward_path(assembly, lens_to_world);
  std::vector<optics::Op> ops = path.ops;
  ops.push_back(optics::last_frame_to_world(path));
  const optics::EmitterPlane emitter = scene.emitter.plane();
  tiles.fit(lens, lens_to_world, path, ops, emitter);
  double seen = 0, area = 0;
  for (const Tile& tile : tiles.tiles())
    if (!tile.unlit) {
      seen += tile.lit.columns * tile.lit.rows;
      area += tile.lit.columns * tile.lit.rows * tile.area;
    }
  EXPECT_LT(seen / 40000, 0.45) << "35 % of the pixels can see the emitter";
  EXPECT_LT(area / seen / 3.14159265, 0.085) << "5.4 % of the hemisphere passes";
}

}  // namespace
}  // namespace relign::imaging
