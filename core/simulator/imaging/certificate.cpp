#include "imaging/certificate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <relign/random.hpp>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;

class DirectionCheck {
 public:
  DirectionCheck(const SceneFile& scene, const optics::BackwardPath& path, const std::vector<optics::Op>& ops,
                 const optics::PupilSearch& search, const optics::Motion& lens_to_world,
                 const optics::BlockTracer* tracer, std::uint64_t seed)
      : source_{scene.sensor,
                search.windows(),
                lens_to_world,
                optics::inverse(lens_to_world),
                static_cast<std::uint32_t>(seed),
                static_cast<std::uint32_t>(seed >> 32)},
        path_(path),
        ops_(ops),
        tracer_(tracer),
        emitter_(scene.emitter.plane()) {}

  void at(const Tile& tile, CheckedPixel& pixel, int rays, optics::RayBlock& block) const {
    const optics::Vec3 middle = middle_of(source_.sensor, tile.box);
    const bool lit = !tile.unlit && holds(tile.lit, pixel.column, pixel.row);
    CheckRay drawn[kBlockRays];
    for (int done = 0; done < rays; done += kBlockRays) {
      for (int i = 0; i < kBlockRays; ++i) {
        drawn[i] = source_.draw(pixel.column, pixel.row, static_cast<std::uint32_t>(done + i));
        optics::put_ray(block, i, path_.into_first_frame.point(drawn[i].place),
                        path_.into_first_frame.direction(drawn[i].direction()));
      }
      if (tracer_)
        tracer_->trace(block, false, kBlockRays);
      else
        optics::block_kernels().trace(block, ops_.data(), static_cast<int>(ops_.size()), false, kBlockRays);
      optics::block_kernels().look_up(block, emitter_, kBlockRays);
      for (int i = 0; i < kBlockRays; ++i) {
        const optics::FloatRay ray{block.x[i],  block.y[i],     block.z[i],     block.lx[i],    block.ly[i],
                                   block.lz[i], block.above[i], block.below[i], block.margin[i]};
        if (!reaches_emitter(ray, emitter_.half_side)) continue;
        ++pixel.arrived;
        pixel.missing += lit && is_sampled(tile.start, tile.whole_disc, middle, drawn[i]) ? 0 : 1;
      }
    }
  }

 private:
  CheckSource source_;
  const optics::BackwardPath& path_;
  const std::vector<optics::Op>& ops_;
  const optics::BlockTracer* tracer_;
  optics::EmitterPlane emitter_;
};

[[noreturn]] void report_missing_light(const SceneFile& scene, const CheckedPixel& pixel, int missing, int arrived,
                                       double wavelength_nm) {
  const optics::Vec3 place = scene.sensor.place(pixel.column + 0.5, pixel.row + 0.5);
  throw Error(ErrorKind::internal,
              "scene '" + scene.name + "': rejected, because images of this lens would miss light: of " +
                  std::to_string(arrived) + " rays in all directions that reach the target" +
                  (wavelength_nm > 0 ? " at " + shortest(wavelength_nm) + " nm, " : ", ") + std::to_string(missing) +
                  " are outside the directions that images sample; most at column " + std::to_string(pixel.column) +
                  ", row " + std::to_string(pixel.row) + " (x = " + significant(place.x, 4) +
                  " mm, y = " + significant(place.y, 4) + " mm on the sensor), " + std::to_string(pixel.missing) +
                  " of " + std::to_string(pixel.arrived) +
                  "; narrow the travel if the lens hits the sensor within it, otherwise please report the lens file");
}

}  // namespace

std::vector<CheckedPixel> pixels_to_check(const std::vector<PixelBox>& tiles, const CertificateRays& rays,
                                          std::uint64_t seed) {
  constexpr std::uint64_t kPlaces = ~std::uint64_t{0};
  std::vector<CheckedPixel> chosen;
  Random random(seed, kPlaces);
  const auto choose = [&](std::size_t tile) {
    const auto within = [&](int count) { return std::min(count - 1, static_cast<int>(random.uniform() * count)); };
    const PixelBox& box = tiles[tile];
    CheckedPixel pixel;
    pixel.column = box.column + within(box.columns);
    pixel.row = box.row + within(box.rows);
    pixel.tile = tile;
    chosen.push_back(pixel);
  };
  for (int i = 0; i < rays.pixels; ++i)
    choose(std::min(tiles.size() - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(tiles.size()))));
  for (int i = 0; i < rays.pixels_a_tile; ++i)
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) choose(tile);
  return chosen;
}

int expect_all_light(const SceneFile& scene, const std::vector<CheckedPixel>& pixels, double wavelength_nm) {
  constexpr int kEnoughInAPixel = 8;
  int arrived = 0, missing = 0;
  const CheckedPixel* worst = nullptr;
  for (const CheckedPixel& pixel : pixels) {
    arrived += pixel.arrived;
    missing += pixel.missing;
    if (!worst || pixel.missing > worst->missing) worst = &pixel;
  }
  if (!worst || missing == 0) return arrived;
  const double allowed = kMaxMissing * arrived;
  const bool dark_pixel = worst->missing >= kEnoughInAPixel && 2 * worst->missing > worst->arrived;
  if (dark_pixel || missing > allowed + 4 * std::sqrt(allowed) + 2)
    report_missing_light(scene, *worst, missing, arrived, wavelength_nm);
  return arrived;
}

int certify(const SceneFile& scene, const PupilTiles& tiles, const optics::BackwardPath& path,
            const std::vector<optics::Op>& ops, const optics::PupilSearch& search, const optics::Motion& lens_to_world,
            const optics::BlockTracer* tracer, const CertificateRays& rays, std::uint64_t seed, Parallel& parallel,
            double wavelength_nm) {
  std::vector<PixelBox> boxes;
  for (const Tile& tile : tiles.tiles()) boxes.push_back(tile.box);
  std::vector<CheckedPixel> pixels = pixels_to_check(boxes, rays, seed);
  const DirectionCheck check(scene, path, ops, search, lens_to_world, tracer, seed);
  std::vector<std::unique_ptr<optics::RayBlock>> blocks;
  for (unsigned thread = 0; thread < parallel.threads(); ++thread)
    blocks.push_back(std::make_unique<optics::RayBlock>());
  parallel.for_each(static_cast<int>(pixels.size()), [&](int index, unsigned thread) {
    CheckedPixel& pixel = pixels[static_cast<std::size_t>(index)];
    check.at(tiles.tiles()[pixel.tile], pixel, rays.rays, *blocks[thread]);
  });
  return expect_all_light(scene, pixels, wavelength_nm);
}

}  // namespace relign::imaging
