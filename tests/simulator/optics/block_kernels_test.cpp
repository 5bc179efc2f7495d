// The float block kernels against the double tracer, and all instruction sets against each other.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <relign/random.hpp>

#include "base/json_source.h"
#include "lens_under_test.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

std::map<std::string, ElementOffset> some_offsets() {
  return {{"L3", {{0.02, -0.01, 0.005}, {0.7, -0.4}}}, {"L4", {{-0.01, 0.03, -0.02}, {-0.3, 0.6}}}};
}

struct Errors {
  double rms_tangent = 0, worst_tangent = 0, worst_mm = 0;
};

// A block of rays from the image of `assembly` back to its object side, and where they must arrive.
struct Returning {
  std::unique_ptr<RayBlock> block = std::make_unique<RayBlock>();
  std::vector<Op> ops;
  std::vector<Ray> forward;
};

Returning returning_rays(const Assembly& assembly, const Motion& lens_to_world) {
  Returning rays;
  const BackwardPath path = backward_path(assembly, lens_to_world);
  RayBlock& block = *rays.block;
  Random random(5);
  int count = 0;
  while (count < kBlockRays) {
    const double field = random.uniform(-0.6, 0.6), across = random.uniform(-0.4, 0.4);
    const Vec3 direction = unit({across, field, 1});
    const Vec3 start{random.uniform(-4, 4), random.uniform(-4, 4), -1};
    const TracedRay traced = trace(assembly, {start, direction}, Apertures::mesh);
    if (!traced.passed) continue;
    const Motion& into = path.into_first_frame;
    put_ray(block, count, into.point(lens_to_world.point(traced.image)),
            into.direction(lens_to_world.direction(-1.0 * traced.exit_direction)));
    rays.forward.push_back({start, direction});
    ++count;
  }
  rays.ops = path.ops;
  rays.ops.push_back(last_frame_to_world(path));
  return rays;
}

// Rays of the double tracer, reversed: they must return to their start.
Errors errors_of_return(const Assembly& assembly) {
  const Motion lens_to_world{rotation_of_degrees(3, -2), {0.4, -0.3, 0.2}};
  Returning rays = returning_rays(assembly, lens_to_world);
  RayBlock& block = *rays.block;
  block_kernels().trace(block, rays.ops.data(), static_cast<int>(rays.ops.size()), true, kBlockRays);
  Errors errors;
  double sum = 0;
  for (int i = 0; i < kBlockRays; ++i) {
    EXPECT_GT(block.margin[i], 0) << i;
    const Ray& forward = rays.forward[static_cast<std::size_t>(i)];
    const Vec3 d = lens_to_world.direction(forward.direction);
    const double error = std::hypot(block.lx[i] / block.lz[i] - d.x / d.z, block.ly[i] / block.lz[i] - d.y / d.z);
    sum += error * error;
    errors.worst_tangent = std::max(errors.worst_tangent, error);
    // The ray's position at the z of the start.
    const Vec3 start = lens_to_world.point(forward.start);
    const double t = (start.z - block.z[i]) / block.lz[i];
    errors.worst_mm = std::max(
        errors.worst_mm, std::hypot(block.x[i] + t * block.lx[i] - start.x, block.y[i] + t * block.ly[i] - start.y));
    const double transmittance = block.above[i] / (block.below[i] * block.below[i]);
    EXPECT_GT(transmittance, 0.4);
    EXPECT_LT(transmittance, 0.8);
  }
  errors.rms_tangent = std::sqrt(sum / kBlockRays);
  return errors;
}

TEST(BlockKernels, MatchDoubleTracer) {
  const Errors errors = errors_of_return(Assembly(relign_od(), some_offsets()));
  EXPECT_LT(errors.rms_tangent, 2e-6) << "object tangent";
  EXPECT_LT(errors.worst_tangent, 1e-5);
  EXPECT_LT(errors.worst_mm, 2e-5);
}

TEST(BlockKernels, MatchDoubleTracerOnConicsAndAspheres) {
  const Errors errors = errors_of_return(Assembly(aspheric_relign_od(), some_offsets()));
  EXPECT_LT(errors.rms_tangent, 2e-6) << "object tangent";
  EXPECT_LT(errors.worst_tangent, 1e-5);
  EXPECT_LT(errors.worst_mm, 2e-5);
}

// A stop in front of a convex face but behind its vertex: its rim is in air, the face protrudes through its opening.
TEST(BlockKernels, StopTheSameRaysInFrontOfConvexFace) {
  const Prescription lens = read_prescription(JsonSource::from_text(R"({"format": 1, "name": "convex", "image_z_mm": 52,
    "elements": [{"name": "L1", "faces": [{"z_mm": 0, "radius_mm": 50, "index_after": 1.5, "clear_radius_mm": 12},
                                          {"z_mm": 4, "radius_mm": -50, "clear_radius_mm": 12}]}],
    "stops": [{"name": "stop", "z_mm": 0.6, "opening_radius_mm": 8, "aperture": true}]})",
                                                                    "convex.json"));
  const Assembly assembly(lens);
  const BackwardPath path = backward_path(assembly, {});
  auto block = std::make_unique<RayBlock>();
  std::vector<double> height_on_stop;
  Random random(3);
  for (int i = 0; i < kBlockRays; ++i) {
    const Vec3 direction = unit({random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1});
    const Vec3 at_stop{random.uniform(-7.5, 7.5), random.uniform(-7.5, 7.5), 0.6};
    const Vec3 start = at_stop - (1.6 / direction.z) * direction;
    height_on_stop.push_back(std::hypot(at_stop.x, at_stop.y));
    const TracedRay free = trace(assembly, {start, direction}, Apertures::none);
    ASSERT_TRUE(free.passed);
    EXPECT_EQ(trace(assembly, {start, direction}, Apertures::mesh).passed, height_on_stop.back() < 8) << i;
    const Vec3 p = path.into_first_frame.point(free.image);
    const Vec3 d = path.into_first_frame.direction(-1.0 * free.exit_direction);
    put_ray(*block, i, p, d);
  }
  block_kernels().trace(*block, path.ops.data(), static_cast<int>(path.ops.size()), true, kBlockRays);
  int lost = 0;
  for (int i = 0; i < kBlockRays; ++i) {
    const double height = height_on_stop[static_cast<std::size_t>(i)];
    if (std::fabs(height - 8) < 1e-3) continue;
    EXPECT_EQ(block->margin[i] > 0, height < 8) << i << " " << height;
    lost += height > 8 ? 1 : 0;
  }
  EXPECT_GT(lost, 3);
}

// Includes lost rays: their values must be the same too.
TEST(BlockKernels, EveryInstructionSetGivesTheSameBits) {
  const Assembly assembly(aspheric_relign_od(), some_offsets());
  Returning rays = returning_rays(assembly, {});
  for (int i = 0; i < kBlockRays; i += 3) rays.block->x[i] += 0.02F * static_cast<float>(i);
  const auto traced_by = [&](const BlockKernels& kernels, bool fresnel) {
    auto block = std::make_unique<RayBlock>(*rays.block);
    kernels.trace(*block, rays.ops.data(), static_cast<int>(rays.ops.size()), fresnel, kBlockRays);
    return block;
  };
  const auto same = [](const float* a, const float* b) { return std::memcmp(a, b, kBlockRays * sizeof(float)) == 0; };
  int compared = 0;
  for (const char* name : {"avx2", "avx512"})
    for (const bool fresnel : {false, true}) {
      const BlockKernels* kernels = block_kernels(name);
      if (!kernels) continue;
      ++compared;
      const auto one = traced_by(generic::kernels(), fresnel);
      const auto other = traced_by(*kernels, fresnel);
      EXPECT_TRUE(same(one->x, other->x) && same(one->y, other->y) && same(one->z, other->z)) << name;
      EXPECT_TRUE(same(one->lx, other->lx) && same(one->ly, other->ly) && same(one->lz, other->lz)) << name;
      EXPECT_TRUE(same(one->above, other->above) && same(one->below, other->below)) << name;
      int lost = 0;
      for (int i = 0; i < kBlockRays; ++i) {
        EXPECT_EQ(one->margin[i] > 0, other->margin[i] > 0) << name << i;
        lost += one->margin[i] > 0 ? 0 : 1;
      }
      EXPECT_GT(lost, 10);
      EXPECT_LT(lost, kBlockRays - 10);
    }
  if (compared == 0) GTEST_SKIP() << "this processor has the generic instructions alone";
}

// Derivatives of the same rays, lost ones included, by the motion of the lens and of one element.
TEST(BlockKernels, EveryInstructionSetGivesTheSameDerivatives) {
  const Assembly assembly(aspheric_relign_od(), some_offsets());
  Returning rays = returning_rays(assembly, {});
  for (int i = 0; i < kBlockRays; i += 3) rays.block->x[i] += 0.02F * static_cast<float>(i);
  const BackwardPath path = backward_path(assembly, {});
  const auto op_count = static_cast<int>(rays.ops.size());
  std::vector<std::uint32_t> texels;
  Random random(3);
  for (int i = 0; i < 64 * 65; ++i) texels.push_back(random.bits());
  EmitterPlane emitter{};
  emitter.distance_z = -40;
  emitter.half_side = 40;
  emitter.texels = 64;
  emitter.texels_per_mm = 0.8F;
  emitter.texels_16_bit = texels.data();
  const auto place = [](std::size_t before) {
    return ReadingPlace{static_cast<std::int32_t>(before), {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.1F, 0.2F, 0.3F}};
  };
  const ReadingPlace places[] = {place(0), place(path.into_element[2].before), place(path.out_of_element[2].before),
                                 place(rays.ops.size())};
  const PartBetween parts[] = {{0, 3}, {1, 2}};
  const SensorView view = {{0.01F, 0, 0}, {0, -0.01F, 0}, 2, {{0, 0, 1}, -5, {0, 0, 1}}};
  constexpr int kNumbers = 2 * kWrenchNumbers;
  const auto differentiated_by = [&](const BlockKernels& kernels, bool fresnel) {
    auto block = std::make_unique<RayBlock>(*rays.block);
    std::vector<float> record(static_cast<std::size_t>(op_count + 1) * kStateNumbers * kBlockRays);
    std::vector<float> adjoints(4 * kPlaceNumbers * kBlockRays), derivatives(kNumbers * kBlockRays);
    kernels.trace_recorded(*block, rays.ops.data(), op_count, fresnel, kBlockRays, record.data());
    kernels.look_up(*block, emitter, kBlockRays);
    kernels.adjoints->trace_back(rays.ops.data(), op_count, fresnel, record.data(), emitter.distance_z, places, 4,
                                 adjoints.data(), kBlockRays);
    kernels.adjoints->differentiate(*block, emitter, fresnel, 0.9F, record.data(), adjoints.data(), view, places, parts,
                                    2, &view.pupil, derivatives.data(), kBlockRays);
    return derivatives;
  };
  int compared = 0, moved = 0;
  for (const char* name : {"avx2", "avx512"})
    for (const bool fresnel : {false, true}) {
      const BlockKernels* kernels = block_kernels(name);
      if (!kernels) continue;
      ++compared;
      const std::vector<float> one = differentiated_by(generic::kernels(), fresnel);
      EXPECT_EQ(one, differentiated_by(*kernels, fresnel)) << name;
      for (const float number : one) {
        EXPECT_TRUE(std::isfinite(number));
        moved += number != 0 ? 1 : 0;
      }
    }
  if (compared == 0) GTEST_SKIP() << "this processor has the generic instructions alone";
  EXPECT_GT(moved, 1000);
}

// Normal incidence on the axis: product of 4 n / (n + 1)^2.
TEST(BlockKernels, MatchFresnelOnTheAxis) {
  const Assembly assembly(relign_od());
  const BackwardPath path = backward_path(assembly, {});
  auto block = std::make_unique<RayBlock>();
  const Vec3 p = path.into_first_frame.point({0, 0, relign_od().image_z_mm});
  for (int i = 0; i < 16; ++i) {
    block->x[i] = block->y[i] = 0;
    block->z[i] = static_cast<float>(p.z);
    block->lx[i] = block->ly[i] = 0;
    block->lz[i] = -1;
    block->above[i] = block->below[i] = block->margin[i] = 1;
  }
  block_kernels().trace(*block, path.ops.data(), static_cast<int>(path.ops.size()), true, 16);
  double expected = 1;
  for (const Element& element : relign_od().elements) {
    const double n = element.faces[0].index_after;
    expected *= std::pow(4 * n / ((n + 1) * (n + 1)), 2);
  }
  EXPECT_NEAR(block->above[0] / (block->below[0] * block->below[0]), expected, 2e-6);
}

TEST(BlockKernels, PhiloxMatchesReference) {
  auto block = std::make_unique<RayBlock>();
  std::uint32_t pixel[kBlockRays], sample[kBlockRays];
  for (std::uint32_t i = 0; i < kBlockRays; ++i) {
    pixel[i] = 1000 * i + 7;
    sample[i] = 3 * i;
  }
  for (const char* name : {"generic", "avx2", "avx512"}) {
    const BlockKernels* kernels = block_kernels(name);
    if (!kernels) continue;
    kernels->philox(*block, pixel, sample, 5, 0xdeadbeef, 0x12345678, kBlockRays);
    for (int i = 0; i < kBlockRays; ++i) {
      const auto expected = philox4x32({sample[i], pixel[i], 5, 0}, {0xdeadbeef, 0x12345678});
      ASSERT_EQ(block->u0[i], expected[0]);
      ASSERT_EQ(block->u1[i], expected[1]);
      ASSERT_EQ(block->u2[i], expected[2]);
      ASSERT_EQ(block->u3[i], expected[3]);
    }
  }
}

TEST(BlockKernels, DirectionsAreUniformOnTheDisc) {
  auto block = std::make_unique<RayBlock>();
  TileStart tile{};
  tile.rotation[0] = tile.rotation[4] = tile.rotation[8] = 1;
  std::uint32_t pixel[kBlockRays], sample[kBlockRays];
  double r2 = 0, x = 0, y = 0, xy = 0, r4 = 0;
  const int blocks = 400;
  for (int b = 0; b < blocks; ++b) {
    for (std::uint32_t i = 0; i < kBlockRays; ++i) {
      pixel[i] = static_cast<std::uint32_t>(b);
      sample[i] = i;
    }
    block_kernels().philox(*block, pixel, sample, 0, 1, 2, kBlockRays);
    std::memset(block->pixel_x, 0, sizeof block->pixel_x);
    std::memset(block->pixel_y, 0, sizeof block->pixel_y);
    block_kernels().start_in_hemisphere(*block, tile, kBlockRays);
    for (int i = 0; i < kBlockRays; ++i) {
      const double p = block->lx[i], q = block->ly[i];
      EXPECT_NEAR(p * p + q * q + block->lz[i] * block->lz[i], 1, 1e-6);
      EXPECT_LE(block->lz[i], 0);
      x += p;
      y += q;
      xy += p * q;
      r2 += p * p + q * q;
      r4 += std::pow(p * p + q * q, 2);
    }
  }
  const double n = blocks * kBlockRays;
  EXPECT_NEAR(x / n, 0, 5 * 0.5 / std::sqrt(n));
  EXPECT_NEAR(y / n, 0, 5 * 0.5 / std::sqrt(n));
  EXPECT_NEAR(xy / n, 0, 5 * 0.21 / std::sqrt(n));
  EXPECT_NEAR(r2 / n, 0.5, 5 * 0.29 / std::sqrt(n));
  EXPECT_NEAR(r4 / n, 1.0 / 3, 5 * 0.3 / std::sqrt(n));
}

}  // namespace
}  // namespace relign::optics
