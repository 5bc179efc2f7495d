// The camera's noise-free MSE, and derivatives of images.
#include "base/error.h"
#include "imaging/camera.h"
#include "imaging/camera_workspace.h"
#include "imaging/diffracted_mse.h"

namespace relign::imaging {

const char* Camera::without_derivatives() const {
  if (tracer_) return "of a lens of meshes";
  if (diffraction_) return "with diffraction";
  return ghosts_ ? "with transport 'ghost'" : nullptr;
}

void Camera::require_derivatives() const {
  if (const char* const why = without_derivatives())
    throw Error(ErrorKind::bad_input, "scene '" + scene_->name + "': images " + why +
                                          " have no derivatives; they exist for a lens of faces, with transport "
                                          "'refract' or 'fresnel'");
}

void Camera::place_for_derivatives(MountedLens& lens, const std::vector<double>& true_pose, const MovingParts& parts) {
  place(lens, true_pose);
  for (View& view : views_)
    view.readings.place(parts, lens.assembly(view.which).lens(), view.path, view.ops.size(),
                        scene_->lens_to_world(true_pose), scene_->sensor.pitch_mm);
}

void Camera::render_derivatives(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                                std::uint32_t group, int samples, const MovingParts& parts, float* pixels,
                                float* derivatives) {
  require_derivatives();
  place_for_derivatives(lens, true_pose, parts);
  std::fill_n(derivatives, scene_->sensor.pixels() * parts.count() * optics::kWrenchNumbers, 0.0F);
  render_tiles(seed, group, samples, pixels, derivatives);
}

MseEstimate Camera::noise_free_mse(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                                   const Reference& reference) {
  place(lens, true_pose);
  if (diffraction_) {
    if (!diffracted_mse_)
      diffracted_mse_ = std::make_unique<DiffractedMse>(*diffraction_, scene_->sensor.width, scene_->sensor.height);
    for (int group = 0; group < kMseGroups; ++group)
      render_rays(seed, static_cast<std::uint32_t>(group), mse_samples_, kMseGhosts, diffracted_mse_->group(group));
    return diffracted_mse_->estimate(reference, *parallel_);
  }
  if (ghosts_)
    for (int group = 0; group < kMseGroups; ++group)
      render_rays(seed, static_cast<std::uint32_t>(group), mse_samples_, kMseGhosts, with_ghosts_[group].data());
  return score_tiles(seed, reference, nullptr);
}

MseEstimate Camera::noise_free_mse(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                                   const Reference& reference, MseSlopes& slopes) {
  require_derivatives();
  place_for_derivatives(lens, true_pose, {});
  return score_tiles(seed, reference, &slopes);
}

MseEstimate Camera::score_tiles(std::uint64_t seed, const Reference& reference, MseSlopes* slopes) {
  if (slopes) tile_slopes_.assign(scored_.size(), {});
  parallel_->for_each(static_cast<int>(scored_.size()), [&](int index, unsigned thread) {
    const auto at = static_cast<std::size_t>(index);
    sums_[at] = score_tile(static_cast<std::size_t>(scored_[at]), seed, reference, *workspaces_[thread],
                           slopes ? &tile_slopes_[at] : nullptr);
  });
  MseSum all;
  for (const MseSum& sum : sums_) all += sum;
  const double pixels = static_cast<double>(scene_->sensor.pixels()) / pixels_per_scored_;
  if (slopes) {
    *slopes = {};
    for (const MseSlopes& tile : tile_slopes_) {
      for (std::size_t i = 0; i < 6; ++i) slopes->gradient[i] += tile.gradient[i] / pixels;
      for (std::size_t i = 0; i < 36; ++i) slopes->gauss_newton[i] += tile.gauss_newton[i] / pixels;
    }
  }
  return estimate_of(all, pixels);
}

void Camera::render_groups(std::size_t tile_index, std::uint64_t seed, Workspace& work, bool slopes) {
  const PixelBox& box = tiles()[tile_index].box;
  for (double(&light)[kTilePixels * kTilePixels] : work.light) std::fill_n(light, box.columns * box.rows, 0.0);
  if (slopes)
    for (auto& group : work.slopes) std::fill_n(&group[0][0], 6 * box.columns * box.rows, 0.0);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Tile& tile = views_[i].tiles.tiles()[tile_index];
    if (tile.unlit || ghosts_) continue;
    const double scale = views_[i].weight * (tile.area / mse_shares_[i]);
    for (int group = 0; group < kMseGroups; ++group) {
      const bool differentiated = slopes && group < kSlopeGroups;
      work.start(*scene_, views_[i], tile, tile.lit, differentiated);
      work.source.lattice_directions(ray_path(views_[i]), seed, static_cast<std::uint32_t>(group), mse_shares_[i]);
      int pixel = 0;
      for (int row = tile.lit.row; row < tile.lit.row + tile.lit.rows; ++row)
        for (int column = tile.lit.column; column < tile.lit.column + tile.lit.columns; ++column, ++pixel) {
          const int in_box = (row - box.row) * box.columns + column - box.column;
          work.light[group][in_box] += scale * static_cast<double>(work.sums[pixel]);
          if (!differentiated) continue;
          const float* const from = work.derivatives.of_pixel(pixel);
          for (int k = 0; k < 6; ++k) work.slopes[group][in_box][k] += scale * static_cast<double>(from[k]);
        }
    }
  }
}

namespace {

// The gradient of (A - O)^2 is 2 (A - O) J, with J from another group than A; J^T J from both.
void add_slopes(const double (&values)[kMseGroups], double reference, const double (&one)[6], const double (&other)[6],
                MseSlopes& slopes) {
  static_assert(kMseGroups == 4 && kSlopeGroups == 2);
  const double last = values[2] + values[3] - 2 * reference;
  const double to_one = (last + values[1] - reference) / 3, to_other = (last + values[0] - reference) / 3;
  for (std::size_t i = 0; i < 6; ++i) {
    slopes.gradient[i] += one[i] * to_one + other[i] * to_other;
    for (std::size_t j = 0; j < 6; ++j) slopes.gauss_newton[6 * i + j] += one[i] * other[j] + other[i] * one[j];
  }
}

}  // namespace

MseSum Camera::score_tile(std::size_t tile, std::uint64_t seed, const Reference& reference, Workspace& work,
                          MseSlopes* slopes) {
  render_groups(tile, seed, work, slopes != nullptr);
  const PixelBox& box = tiles()[tile].box;
  MseSum sum;
  int in_tile = 0;
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column, ++in_tile) {
      const auto at = static_cast<std::size_t>(row * scene_->sensor.width + column);
      const double o1 = static_cast<double>(reference.first[at]), o2 = static_cast<double>(reference.second[at]);
      double values[kMseGroups];
      for (int group = 0; group < kMseGroups; ++group)
        values[group] = ghosts_ ? static_cast<double>(with_ghosts_[group][at]) : work.light[group][in_tile];
      sum += mse_of_pixel(values, o1, o2);
      if (slopes) add_slopes(values, 0.5 * (o1 + o2), work.slopes[0][in_tile], work.slopes[1][in_tile], *slopes);
    }
  return sum;
}

}  // namespace relign::imaging
