// The arithmetic of single rays, which GPU kernels use, against the block kernels and Optiland's rays.
#include "optics/ray_steps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numeric>
#include <relign/random.hpp>

#include "lens_under_test.h"
#include "optics/asphere_steps.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"
#include "optics/ray_file.h"
#include "optics/tile_start.h"

namespace relign::optics::ray_steps {
namespace {

// With two conics, no polynomial.
Prescription conic_relign_od() {
  Prescription lens = relign_od();
  lens.elements[0].faces[1].conic = -0.6;
  lens.elements[3].faces[1].conic = -1;
  return lens;
}

struct Scene {
  std::vector<Op> ops;
  TileStart tile{};
  PixelPlaces places{12, -6, -6, 4000, 200};
  EmitterPlane emitter{};
  std::vector<std::uint16_t> bytes;
  std::vector<std::uint32_t> pairs;
};

// A tile of the paper's set-up, with a target of random texels.
Scene scene_of(const Assembly& assembly, bool eight_bits) {
  Scene scene;
  const Motion lens_to_world{rotation_of_degrees(1, -0.5), {0.1, -0.1, -16.98}};
  const BackwardPath path = backward_path(assembly, lens_to_world);
  scene.ops = path.ops;
  scene.ops.push_back(last_frame_to_world(path));
  TileStart& tile = scene.tile;
  tile.pixel_pitch_x = 0.026F;
  tile.pixel_pitch_y = -0.026F;
  tile.axes[0] = 0.28F;  // larger than what passes, so that rays are lost
  tile.axes[2] = 0.01F;
  tile.axes[3] = 0.28F;
  tile.slope[0] = tile.slope[3] = 0.1F;
  set_first_frame(tile, path.into_first_frame, {0.4, -0.3, 3.61});
  constexpr int kTexels = 256;
  Random random(2);
  for (int i = 0; i < kTexels * kTexels + 2 * kTexels; ++i) {
    scene.bytes.push_back(static_cast<std::uint16_t>(random.bits()));
    scene.pairs.push_back(random.bits());
  }
  scene.emitter.distance_z = -469;
  scene.emitter.half_side = 300;
  scene.emitter.texels = kTexels;
  scene.emitter.texels_per_mm = kTexels / 600.0F;
  scene.emitter.texels_8_bit = eight_bits ? scene.bytes.data() : nullptr;
  scene.emitter.texels_16_bit = eight_bits ? nullptr : scene.pairs.data();
  return scene;
}

bool same(const float* block, int i, float value) { return std::memcmp(block + i, &value, sizeof value) == 0; }

void expect_bits_of_blocks(const Scene& scene, const BlockKernels& kernels, bool fresnel, bool disc) {
  auto block = std::make_unique<RayBlock>();
  std::uint32_t owner[kBlockRays], number[kBlockRays], sample[kBlockRays];
  for (std::uint32_t i = 0; i < kBlockRays; ++i) {
    owner[i] = i % 144;
    sample[i] = i / 144 + 3;
  }
  kernels.take_pixels(*block, scene.tile, scene.places, owner, number, kBlockRays);
  kernels.philox(*block, number, sample, 1, 77, 5, kBlockRays);
  (disc ? kernels.start_in_hemisphere : kernels.start_in_ellipse)(*block, scene.tile, kBlockRays);
  kernels.trace(*block, scene.ops.data(), static_cast<int>(scene.ops.size()), fresnel, kBlockRays);
  kernels.look_up(*block, scene.emitter, kBlockRays);
  kernels.play_roulette(*block, 0.7F, kBlockRays);
  int lit = 0;
  for (int i = 0; i < kBlockRays; ++i) {
    const PixelStart from = pixel_start(scene.tile, scene.places, 1.0F / 12, static_cast<std::int32_t>(owner[i]));
    ASSERT_EQ(from.number, number[i]);
    std::uint32_t words[4] = {sample[i], number[i], 1, 0};
    philox_rounds(words, 77, 5);
    ASSERT_EQ(words[3], block->u3[i]);
    const std::uint32_t roulette = fifth_word(words[0], words[1], words[2], words[3]);
    FloatRay ray = disc ? start_in_hemisphere(scene.tile, from.x, from.y, words[0], words[1], words[2], words[3])
                        : start_in_ellipse(scene.tile, from.x, from.y, words[0], words[1], words[2], words[3]);
    if (fresnel)
      trace_ray<true>(ray, scene.ops.data(), static_cast<std::int32_t>(scene.ops.size()));
    else
      trace_ray<false>(ray, scene.ops.data(), static_cast<std::int32_t>(scene.ops.size()));
    const float seen =
        scene.emitter.texels_8_bit ? look_up<true>(ray, scene.emitter) : look_up<false>(ray, scene.emitter);
    const float radiance = survives(ray, roulette, 0.7F) ? seen : 0.0F;
    ASSERT_EQ(ray.margin > 0, block->margin[i] > 0) << i;
    ASSERT_TRUE(same(block->radiance, i, radiance)) << i << " " << radiance;
    if (!(ray.margin > 0)) continue;  // the values of a lost ray may be NaN of either sign
    ASSERT_TRUE(same(block->x, i, ray.x) && same(block->y, i, ray.y) && same(block->z, i, ray.z)) << i;
    ASSERT_TRUE(same(block->lx, i, ray.lx) && same(block->ly, i, ray.ly) && same(block->lz, i, ray.lz)) << i;
    ASSERT_TRUE(same(block->above, i, ray.above) && same(block->below, i, ray.below)) << i;
    ASSERT_TRUE(same(block->margin, i, ray.margin)) << i;
    lit += radiance > 0 ? 1 : 0;
  }
  if (disc) return;  // few of these pass
  EXPECT_GT(lit, 40);
  EXPECT_LT(lit, kBlockRays - 40);
}

TEST(RaySteps, HaveTheBitsOfTheBlockKernels) {
  const std::map<std::string, ElementOffset> offsets = {{"L3", {{0.02, -0.01, 0.005}, {0.7, -0.4}}},
                                                        {"L4", {{-0.01, 0.03, -0.02}, {-0.3, 0.6}}}};
  for (const Prescription& lens : {relign_od(), conic_relign_od()})
    for (const bool eight_bits : {true, false}) {
      const Scene scene = scene_of(Assembly(lens, offsets), eight_bits);
      for (const char* set : {"generic", "avx2", "avx512"})
        for (const bool fresnel : {true, false})
          for (const bool disc : {true, false})
            if (const BlockKernels* kernels = block_kernels(set)) expect_bits_of_blocks(scene, *kernels, fresnel, disc);
    }
}

// Distances of hits from Optiland's, mm: each ray back from its image, face by face.
template <class Real>
std::vector<double> distances_from_optiland(std::vector<OpOf<Real>> BackwardPath::*ops) {
  const auto source = JsonSource::from_file(std::string(RELIGN_TEST_DATA) + "/golden_rays_relign_od.json");
  const auto requests = read_rays(source, relign_od());
  std::vector<double> distances;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const Json& golden = source.root().at("rays").at(i);
    const auto vector = [&](const Json& v) { return Vec3{v.at(0), v.at(1), v.at(2)}; };
    const Assembly assembly(relign_od(), requests[i].elements);
    const BackwardPath path = backward_path(assembly, {});
    const Vec3 start = path.into_first_frame.point(vector(golden.at("image_mm")));
    const Vec3 along = path.into_first_frame.direction(-1.0 * vector(golden.at("exit_direction")));
    const auto real = [](double value) { return static_cast<Real>(value); };
    RayOf<Real> ray{real(start.x), real(start.y), real(start.z), real(along.x), real(along.y), real(along.z), 1, 1, 1};
    std::size_t face = relign_od().face_count();
    for (const OpOf<Real>& op : path.*ops) {
      trace_ray<true>(ray, &op, 1);
      if (op.kind != OpKinds::face) continue;
      --face;
      const std::size_t element = face / 2;
      const Vec3 hit = assembly.placement(element).point(
          Vec3{ray.x, ray.y, ray.z} + Vec3{0, 0, relign_od().elements[element].faces[face % 2].z_mm});
      const Vec3 off = hit - vector(golden.at("hits_mm").at(face));
      distances.push_back(std::sqrt(dot(off, off)));
    }
    EXPECT_EQ(face, 0u);
  }
  EXPECT_EQ(distances.size(), 12u * 8);
  return distances;
}

TEST(RaySteps, MatchOptilandInFloat) {
  const std::vector<double> off = distances_from_optiland(&BackwardPath::ops);
  EXPECT_LT(*std::max_element(off.begin(), off.end()), 2e-6);
  EXPECT_LT(std::sqrt(std::inner_product(off.begin(), off.end(), off.begin(), 0.0) / static_cast<double>(off.size())),
            1e-6);
}

// The same functions: what float adds above is rounding.
TEST(RaySteps, MatchOptilandInDouble) {
  const std::vector<double> off = distances_from_optiland(&BackwardPath::exact_ops);
  EXPECT_LT(*std::max_element(off.begin(), off.end()), 1e-12);
}

}  // namespace
}  // namespace relign::optics::ray_steps
