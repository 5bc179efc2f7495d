// Prints the bits that the ray kernels and the functions of portable numbers give on some hundred rays.
#include <cstdio>
#include <cstring>
#include <memory>
#include <relign/portable_math.hpp>
#include <relign/random.hpp>

#include "optics/ray_block.h"

namespace relign::optics {
namespace {

Op face(float vertex_z, float radius, float before, float after, float conic_plus_1 = 1) {
  Op op{};
  op.kind = conic_plus_1 == 1 ? Op::face : Op::asphere;
  op.vertex_z = vertex_z;
  op.curvature = 1 / radius;
  op.index_before = before;
  op.index_after = after;
  op.index_ratio = before / after;
  op.clear_radius2 = 9;
  op.conic_plus_1 = op.near_conic_plus_1 = conic_plus_1;
  op.near_curvature = op.curvature;
  op.shape_radius = 4;
  op.per_shape_radius2 = 1.0F / 16;
  return op;
}

void print(const char* what, const void* values, std::size_t bytes) {
  std::printf("%s", what);
  for (std::size_t i = 0; i < bytes; ++i) {
    unsigned char byte;
    std::memcpy(&byte, static_cast<const char*>(values) + i, 1);
    std::printf("%02x", byte);
  }
  std::printf("\n");
}

void print_block(const char* what, const RayBlock& block) {
  for (const float* values : {block.x, block.y, block.z, block.lx, block.ly, block.lz, block.above, block.below,
                              block.margin, block.radiance})
    print(what, values, sizeof(float) * kBlockRays);
}

int run() {
  const BlockKernels& kernels = generic::kernels();
  const auto block = std::make_unique<RayBlock>();
  std::memset(block.get(), 0, sizeof *block);
  std::uint32_t pixel[kBlockRays], sample[kBlockRays];
  for (std::uint32_t i = 0; i < kBlockRays; ++i) {
    pixel[i] = i / 8;
    sample[i] = i % 8;
  }
  kernels.philox(*block, pixel, sample, 3, 0x12345678, 0x9abcdef0, kBlockRays);
  print("philox ", block->u0, sizeof block->u0);
  TileStart tile{};
  tile.pixel_pitch_x = tile.pixel_pitch_y = 0.005F;
  tile.centre[0] = 0.02F;
  tile.axes[0] = tile.axes[3] = 0.2F;
  for (const int i : {0, 4, 8}) tile.rotation[i] = 1;
  kernels.start_in_ellipse(*block, tile, kBlockRays);
  print_block("start ", *block);
  const Op lens[] = {face(-4, -20, 1, 1.5F), face(-2, 15, 1.5F, 1), face(-3, -30, 1, 1.7F, 0.3F),
                     face(-1, 40, 1.7F, 1)};
  kernels.trace(*block, lens, 4, true, kBlockRays);
  print_block("trace ", *block);
  for (float& radiance : block->radiance) radiance = 0.7F;
  kernels.apply_transmittance(*block, kBlockRays);
  float sums[kBlockRays / 8];
  kernels.sum_runs(*block, 8, sums, kBlockRays);
  print("sums ", sums, sizeof sums);
  Random random(20261129);
  for (int i = 0; i < 200; ++i) {
    const auto [sine, cosine] = portable_sine_cosine(random.uniform(-360, 360));
    const double numbers[] = {random.normal(), sine, cosine, portable_log(random.uniform()),
                              portable_exp(random.uniform(-9, 9))};
    print("numbers ", numbers, sizeof numbers);
  }
  return 0;
}

}  // namespace
}  // namespace relign::optics

int main() { return relign::optics::run(); }
