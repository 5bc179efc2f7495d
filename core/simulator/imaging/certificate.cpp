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

struct PixelCount {
  int column = 0, row = 0;
  int arrived = 0;  // rays that reach the target
  int missing = 0;  // of these, outside the directions that images sample
};

bool holds(const PixelBox& box, int column, int row) {
  return column >= box.column && column < box.column + box.columns && row >= box.row && row < box.row + box.rows;
}

// Whether an image's rays from (x, y), relative to the tile's centre, include the direction cosines (p, q).
bool sampled(const Tile& tile, int column, int row, double x, double y, double p, double q) {
  constexpr double kRounding = 1e-4;
  if (tile.unlit || !holds(tile.lit, column, row)) return false;
  if (tile.whole_disc) return true;
  const auto of = [](float value) { return static_cast<double>(value); };
  const optics::TileStart& start = tile.start;
  const double dp = p - (of(start.centre[0]) + of(start.slope[0]) * x + of(start.slope[1]) * y);
  const double dq = q - (of(start.centre[1]) + of(start.slope[2]) * x + of(start.slope[3]) * y);
  const double a = dp / of(start.axes[0]), b = (dq - of(start.axes[2]) * a) / of(start.axes[3]);
  return a * a + b * b <= 1 + kRounding;
}

class DirectionCheck {
 public:
  DirectionCheck(const SceneFile& scene, const optics::BackwardPath& path, const std::vector<optics::Op>& ops,
                 const optics::PupilSearch& search, const optics::Motion& lens_to_world,
                 const optics::BlockTracer* tracer)
      : scene_(scene),
        path_(path),
        ops_(ops),
        search_(search),
        to_world_(lens_to_world),
        into_lens_(optics::inverse(lens_to_world)),
        tracer_(tracer),
        emitter_(scene.emitter.plane()) {}

  void at(const Tile& tile, PixelCount& pixel, int rays, std::uint64_t seed, optics::RayBlock& block) const {
    const Sensor& sensor = scene_.sensor;
    const optics::Vec3 middle =
        sensor.place(tile.box.column + 0.5 * tile.box.columns, tile.box.row + 0.5 * tile.box.rows);
    Random random(seed, static_cast<std::uint64_t>(pixel.row) * static_cast<std::uint64_t>(sensor.width) +
                            static_cast<std::uint64_t>(pixel.column));
    double x[kBlockRays], y[kBlockRays], p[kBlockRays], q[kBlockRays];
    for (int done = 0; done < rays; done += kBlockRays) {
      for (int i = 0; i < kBlockRays; ++i) {
        const optics::Vec3 place = sensor.place(pixel.column + random.uniform(), pixel.row + random.uniform());
        const bool near = i % 2 != 0 && near_light(place, random, p[i], q[i]);
        while (!near) {
          p[i] = 2 * random.uniform() - 1;
          q[i] = 2 * random.uniform() - 1;
          if (p[i] * p[i] + q[i] * q[i] < 1) break;
        }
        const optics::Vec3 start = path_.into_first_frame.point(place);
        const optics::Vec3 direction =
            path_.into_first_frame.direction({p[i], q[i], -std::sqrt(1 - p[i] * p[i] - q[i] * q[i])});
        x[i] = place.x - middle.x;
        y[i] = place.y - middle.y;
        optics::put_ray(block, i, start, direction);
      }
      if (tracer_)
        tracer_->trace(block, false, kBlockRays);
      else
        optics::block_kernels().trace(block, ops_.data(), static_cast<int>(ops_.size()), false, kBlockRays);
      optics::block_kernels().look_up(block, emitter_, kBlockRays);
      for (int i = 0; i < kBlockRays; ++i) {
        const bool arrives = block.margin[i] > 0 && block.lz[i] < 0 && std::fabs(block.x[i]) < emitter_.half_side &&
                             std::fabs(block.y[i]) < emitter_.half_side;
        if (!arrives) continue;
        ++pixel.arrived;
        pixel.missing += sampled(tile, pixel.column, pixel.row, x[i], y[i], p[i], q[i]) ? 0 : 1;
      }
    }
  }

 private:
  // Draws a direction near those in which the design sends light to a point; false if it sends none.
  bool near_light(const optics::Vec3& place, Random& random, double& p, double& q) const {
    constexpr double kWidening = 2;
    const optics::Vec3 at = into_lens_.point(place);
    const optics::DirectionWindow window = search_.window(at);
    if (window.empty) return false;
    double side[2];
    for (std::size_t axis = 0; axis < 2; ++axis)
      side[axis] = (window.low[axis] + window.high[axis]) / 2 +
                   kWidening * (random.uniform() - 0.5) * (window.high[axis] - window.low[axis]);
    const double radius = std::sqrt(at.x * at.x + at.y * at.y);
    const double cosine = radius > 0 ? at.x / radius : 1, sine = radius > 0 ? at.y / radius : 0;
    const double a = cosine * side[0] - sine * side[1], b = sine * side[0] + cosine * side[1];
    if (!(a * a + b * b < 1)) return false;
    const optics::Vec3 direction = to_world_.direction({a, b, -std::sqrt(1 - a * a - b * b)});
    p = direction.x;
    q = direction.y;
    return direction.z < 0;
  }

  const SceneFile& scene_;
  const optics::BackwardPath& path_;
  const std::vector<optics::Op>& ops_;
  const optics::PupilSearch& search_;
  optics::Motion to_world_, into_lens_;
  const optics::BlockTracer* tracer_;
  optics::EmitterPlane emitter_;
};

[[noreturn]] void report_missing_light(const SceneFile& scene, const PixelCount& pixel, int missing, int arrived,
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

int certify(const SceneFile& scene, const PupilTiles& tiles, const optics::BackwardPath& path,
            const std::vector<optics::Op>& ops, const optics::PupilSearch& search, const optics::Motion& lens_to_world,
            const optics::BlockTracer* tracer, const CertificateRays& rays, std::uint64_t seed, Parallel& parallel,
            double wavelength_nm) {
  constexpr std::uint64_t kPlaces = ~std::uint64_t{0};
  const std::vector<Tile>& all = tiles.tiles();
  std::vector<std::pair<const Tile*, PixelCount>> chosen;
  Random random(seed, kPlaces);
  const auto choose = [&](const Tile& tile) {
    const auto within = [&](int count) { return std::min(count - 1, static_cast<int>(random.uniform() * count)); };
    chosen.push_back({&tile, {tile.box.column + within(tile.box.columns), tile.box.row + within(tile.box.rows)}});
  };
  for (int i = 0; i < rays.pixels; ++i)
    choose(all[std::min(all.size() - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(all.size())))]);
  for (int i = 0; i < rays.pixels_a_tile; ++i)
    for (const Tile& tile : all) choose(tile);

  const DirectionCheck check(scene, path, ops, search, lens_to_world, tracer);
  std::vector<std::unique_ptr<optics::RayBlock>> blocks;
  for (unsigned thread = 0; thread < parallel.threads(); ++thread)
    blocks.push_back(std::make_unique<optics::RayBlock>());
  parallel.for_each(static_cast<int>(chosen.size()), [&](int index, unsigned thread) {
    auto& [tile, pixel] = chosen[static_cast<std::size_t>(index)];
    check.at(*tile, pixel, rays.rays, seed, *blocks[thread]);
  });

  constexpr int kEnoughInAPixel = 8;
  int arrived = 0, missing = 0;
  const PixelCount* worst = nullptr;
  for (const auto& [tile, pixel] : chosen) {
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

}  // namespace relign::imaging
