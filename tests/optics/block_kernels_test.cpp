// The float blocks against the double tracer, and every instruction set against the others.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <relign/random.hpp>

#include "lens_under_test.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

std::map<std::string, ElementOffset> some_offsets() {
  return {{"L3", {{0.02, -0.01, 0.005}, {0.7, -0.4}}}, {"L4", {{-0.01, 0.03, -0.02}, {-0.3, 0.6}}}};
}

// Rays of the double tracer, sent back: they must return to where they came from.
TEST(BlockKernels, ReturnTheRaysOfTheDoubleTracer) {
  const Assembly assembly(relign_od(), some_offsets());
  const Motion lens_to_world{rotation_of_degrees(3, -2), {0.4, -0.3, 0.2}};
  const BackwardPath path = backward_path(assembly, lens_to_world);
  auto block = std::make_unique<RayBlock>();
  std::vector<Ray> forward;
  Random random(5);
  int count = 0;
  while (count < kBlockRays) {
    const double field = random.uniform(-0.6, 0.6), across = random.uniform(-0.4, 0.4);
    const Vec3 direction = unit({across, field, 1});
    const Vec3 start{random.uniform(-4, 4), random.uniform(-4, 4), -1};
    const TracedRay traced = trace(assembly, {start, direction}, Apertures::mesh);
    if (!traced.passed) continue;
    const Motion& into = path.into_first_frame;
    const Vec3 p = into.point(lens_to_world.point(traced.image));
    const Vec3 d = into.direction(lens_to_world.direction(-1.0 * traced.exit_direction));
    block->x[count] = static_cast<float>(p.x);
    block->y[count] = static_cast<float>(p.y);
    block->z[count] = static_cast<float>(p.z);
    block->lx[count] = static_cast<float>(d.x);
    block->ly[count] = static_cast<float>(d.y);
    block->lz[count] = static_cast<float>(d.z);
    block->above[count] = block->below[count] = block->margin[count] = 1;
    forward.push_back({start, direction});
    ++count;
  }
  std::vector<Op> ops = path.ops;
  ops.push_back(last_frame_to_world(path));
  block_kernels().trace(*block, ops.data(), static_cast<int>(ops.size()), true, kBlockRays);
  double sum = 0, worst = 0;
  for (int i = 0; i < kBlockRays; ++i) {
    ASSERT_GT(block->margin[i], 0) << i;
    const Vec3 d = lens_to_world.direction(forward[i].direction);
    const double tangent_x = d.x / d.z, tangent_y = d.y / d.z;
    const double error = std::hypot(block->lx[i] / block->lz[i] - tangent_x, block->ly[i] / block->lz[i] - tangent_y);
    sum += error * error;
    worst = std::max(worst, error);
    // The ray's line passes the start: its place at the start's height.
    const Vec3 start = lens_to_world.point(forward[i].start);
    const double t = (start.z - block->z[i]) / block->lz[i];
    EXPECT_NEAR(block->x[i] + t * block->lx[i], start.x, 2e-5);
    EXPECT_NEAR(block->y[i] + t * block->ly[i], start.y, 2e-5);
    const double transmittance = block->above[i] / (block->below[i] * block->below[i]);
    EXPECT_GT(transmittance, 0.4);
    EXPECT_LT(transmittance, 0.8);
  }
  RecordProperty("rms", std::to_string(1e9 * std::sqrt(sum / kBlockRays)));
  EXPECT_LT(std::sqrt(sum / kBlockRays), 2e-6) << "object tangent";
  EXPECT_LT(worst, 1e-5);
}

// Normal incidence on the axis: product of 4 n / (n + 1)^2.
TEST(BlockKernels, FresnelOnTheAxis) {
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

TEST(BlockKernels, PhiloxIsPhilox) {
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

TEST(BlockKernels, DirectionsFillTheDiscEvenly) {
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
