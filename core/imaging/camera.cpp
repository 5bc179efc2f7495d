#include "imaging/camera.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "imaging/diffracted_truth.h"
#include "imaging/ray_source.h"
#include "imaging/read_out.h"

namespace relign::imaging {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Russian roulette of the paper's renderer: 0.95 at each of the last four faces. One die for all
// dice: a ray survives with the product of all probabilities.
constexpr double kRouletteSurvival = 0.95 * 0.95 * 0.95 * 0.95;

// Walks meet a face from either side and a second time, which is solved for spheres alone, and stops where they are.
void refuse_ghosts(const optics::Prescription& lens) {
  for (const optics::Stop& stop : lens.stops)
    if (stop.before_face)
      throw Error(ErrorKind::bad_input, "lens '" + lens.name + "': the stop '" + stop.name + "' has a \"" +
                                            (stop.on_face ? "on_face" : "before_face") +
                                            "\", and transport ghost follows light among stops in the air only; use "
                                            "transport fresnel");
  for (const optics::Element& element : lens.elements)
    for (std::size_t f = 0; f < element.faces.size(); ++f)
      if (!element.faces[f].is_sphere())
        throw Error(ErrorKind::bad_input, "lens '" + lens.name + "': face " + std::to_string(f + 1) + " of " +
                                              element.name +
                                              " is aspheric, and transport ghost follows light among spheres and "
                                              "planes only; use transport fresnel");
}

}  // namespace

std::optional<Transport> transport_from_name(const std::string& name) {
  if (name == "refract") return Transport::refract;
  if (name == "fresnel") return Transport::fresnel;
  if (name == "ghost") return Transport::ghost;
  return std::nullopt;
}

const char* name_of(Transport transport) {
  switch (transport) {
    case Transport::refract:
      return "refract";
    case Transport::fresnel:
      return "fresnel";
    case Transport::ghost:
      return "ghost";
  }
  return "";
}

std::optional<Sampler> sampler_from_name(const std::string& name) {
  if (name == "paper") return Sampler::paper;
  if (name == "hemisphere") return Sampler::hemisphere;
  if (name == "pupil") return Sampler::pupil;
  return std::nullopt;
}

// What one thread needs: a block of rays and who owns them.
struct Camera::Workspace {
  RaySource source;
  optics::RayBlock words;  // of the read-out
  float sums[kTruthGroups][kTilePixels * kTilePixels];
  float ghosts[kTruthGroups][kTilePixels * kTilePixels];
  GhostImage::Workspace paths;
};

Camera::Camera(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel, optics::BlockTracer* tracer)
    : scene_(&scene), settings_(settings), parallel_(&parallel), tracer_(tracer), tiles_(scene, parallel) {
  for (unsigned thread = 0; thread < parallel.threads(); ++thread) workspaces_.push_back(std::make_unique<Workspace>());
  sums_.resize(tiles_.tiles().size());
  emitter_ = scene.emitter.plane();
  if (scene.diffraction) diffraction_.emplace(scene);
  if (settings.transport != Transport::ghost) return;
  refuse_ghosts(scene.lens);
  ghosts_.emplace(scene, settings.sensor_albedo);
}

Camera::~Camera() = default;

void Camera::set_capture(Sampler sampler, int samples) {
  settings_.sampler = sampler;
  settings_.samples = samples;
}

void Camera::place(MountedLens& lens, const std::vector<double>& true_pose) {
  const optics::Motion lens_to_world = scene_->lens_to_world(true_pose);
  if (ghosts_) ghosts_->place(lens.assembly(), lens_to_world);
  optics::set_backward_path(path_, lens.assembly(), lens_to_world);
  ops_.assign(path_.ops.begin(), path_.ops.end());
  ops_.push_back(optics::last_frame_to_world(path_));
  tiles_.fit(lens, lens_to_world, path_, ops_, emitter_);
  if (tracer_) tracer_->place(lens.assembly(), lens_to_world, path_);
}

void Camera::certify(MountedLens& lens, const std::vector<double>& true_pose, const CertificateRays& rays,
                     std::uint64_t seed) {
  place(lens, true_pose);
  imaging::certify(*scene_, tiles_, path_, ops_, tracer_, rays, seed, *parallel_);
}

namespace {

void fill_with_black(const PixelBox& box, int width, float* pixels) {
  for (int row = box.row; row < box.row + box.rows; ++row)
    std::fill_n(pixels + row * width + box.column, box.columns, 0.0F);
}

// The place of a pixel in a box, row by row; -1 outside.
int place_in(const PixelBox& box, int column, int row) {
  const bool inside =
      column >= box.column && column < box.column + box.columns && row >= box.row && row < box.row + box.rows;
  return inside ? (row - box.row) * box.columns + column - box.column : -1;
}

void write_pixels(const PixelBox& box, const float* sums, double factor, int width, float* pixels) {
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column)
      pixels[row * width + column] = static_cast<float>(factor * static_cast<double>(*sums++));
}

}  // namespace

RayPath Camera::way() const {
  const bool fresnel = settings_.transport != Transport::refract;
  return {ops_.data(), static_cast<int>(ops_.size()), &emitter_, fresnel, fresnel ? path_.highest_transmittance : 1.0,
          tracer_};
}

// Runs body(tile, workspace) for every tile that sees the emitter; the others become black.
template <class Body>
void Camera::for_seen_tiles(float* pixels, const Body& body) {
  const std::vector<Tile>& tiles = tiles_.tiles();
  const int width = scene_->sensor.width;
  parallel_->for_each(static_cast<int>(tiles.size()), [&](int index, unsigned thread) {
    const Tile& tile = tiles[static_cast<std::size_t>(index)];
    if (!tile.blind) {
      if (tile.seen.columns < tile.box.columns || tile.seen.rows < tile.box.rows)
        fill_with_black(tile.box, width, pixels);
      body(tile, *workspaces_[thread]);
    } else if (pixels) {
      fill_with_black(tile.box, width, pixels);
    }
  });
}

void Camera::play_ghosts(std::uint64_t seed, float* pixels) {
  parallel_->for_each(static_cast<int>(tiles_.tiles().size()), [&](int index, unsigned thread) {
    const PixelBox& box = tiles_.tiles()[static_cast<std::size_t>(index)].box;
    GhostImage::Workspace& work = workspaces_[thread]->paths;
    if (settings_.sampler == Sampler::hemisphere)
      ghosts_->capture_everywhere(box, seed, settings_.samples, work, pixels);
    else
      ghosts_->capture(box, seed, settings_.samples, work, pixels);
  });
}

void Camera::add_ghosts(std::uint64_t seed, std::uint32_t group, int samples, float* pixels) {
  if (!ghosts_) return;
  parallel_->for_each(static_cast<int>(tiles_.tiles().size()), [&](int index, unsigned thread) {
    const PixelBox& box = tiles_.tiles()[static_cast<std::size_t>(index)].box;
    Workspace& work = *workspaces_[thread];
    ghosts_->ghost_part(box, seed, group, samples, work.paths, work.ghosts[0]);
    const float* value = work.ghosts[0];
    for (int row = box.row; row < box.row + box.rows; ++row)
      for (int column = box.column; column < box.column + box.columns; ++column)
        pixels[row * scene_->sensor.width + column] += *value++;
  });
}

void Camera::capture(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, float* pixels) {
  place(lens, true_pose);
  catch_light(seed, pixels);
  add_diffraction(pixels);
  if (!scene_->sensor.electronics) return;
  const ShotNoise shot_noise = settings_.sampler == Sampler::pupil ? ShotNoise::added : ShotNoise::in_the_light;
  const int width = scene_->sensor.width;
  parallel_->for_each(scene_->sensor.height, [&](int row, unsigned thread) {
    read_out(*scene_->sensor.electronics, shot_noise, seed, row * width, width, pixels + row * width,
             workspaces_[thread]->words);
  });
}

void Camera::catch_light(std::uint64_t seed, float* pixels) {
  if (ghosts_ && settings_.sampler != Sampler::pupil) {
    play_ghosts(seed, pixels);
    return;
  }
  const int width = scene_->sensor.width;
  const RayPath way = this->way();
  if (settings_.sampler == Sampler::hemisphere) {
    // Every tile, blind or not: this sampler assumes nothing.
    parallel_->for_each(static_cast<int>(tiles_.tiles().size()), [&](int index, unsigned thread) {
      const Tile& tile = tiles_.tiles()[static_cast<std::size_t>(index)];
      Workspace& work = *workspaces_[thread];
      work.source.start_tile(*scene_, path_, tile, tile.box, work.sums[0]);
      work.source.all_directions(way, seed, settings_.samples, kRouletteSurvival);
      write_pixels(tile.box, work.sums[0], kPi / settings_.samples / kRouletteSurvival, width, pixels);
    });
    return;
  }
  for_seen_tiles(pixels, [&](const Tile& tile, Workspace& work) {
    work.source.start_tile(*scene_, path_, tile, tile.seen, work.sums[0]);
    if (settings_.sampler == Sampler::paper) {
      work.source.binomial_directions(way, seed, settings_.samples, kRouletteSurvival);
      write_pixels(tile.seen, work.sums[0], kPi / settings_.samples / kRouletteSurvival, width, pixels);
    } else {
      work.source.random_directions(way, seed, settings_.samples);
      write_pixels(tile.seen, work.sums[0], tile.area / settings_.samples, width, pixels);
    }
  });
  add_ghosts(seed, 0, settings_.samples, pixels);
}

void Camera::render_noise_free(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, int samples,
                               float* pixels) {
  place(lens, true_pose);
  render_rays(seed, 0, samples, std::max(1, samples / kRaysPerGhost), pixels);
  add_diffraction(pixels);
}

void Camera::render_rays(std::uint64_t seed, std::uint32_t group, int samples, int ghosts, float* pixels) {
  const RayPath way = this->way();
  for_seen_tiles(pixels, [&](const Tile& tile, Workspace& work) {
    work.source.start_tile(*scene_, path_, tile, tile.seen, work.sums[0]);
    work.source.lattice_directions(way, seed, group, samples);
    write_pixels(tile.seen, work.sums[0], tile.area / samples, scene_->sensor.width, pixels);
  });
  add_ghosts(seed, group, ghosts, pixels);
}

void Camera::add_diffraction(float* pixels) {
  if (diffraction_) diffraction_->blur(pixels, pixels, *parallel_, blurring_);
}

// What one pixel adds, from one value of each group.
void Camera::add_truth(const double (&seen)[kTruthGroups], double o1, double o2, TileSum& sum) {
  constexpr int groups = kTruthGroups;
  double total = 0, crossed = 0;
  for (const double a : seen) {
    total += a;
    crossed += (a - o1) * (a - o2);
  }
  // Mean over pairs of different groups of (A_i - O1)(A_j - O2).
  sum.product += ((total - groups * o1) * (total - groups * o2) - crossed) / (groups * (groups - 1));
  // Its variance is (d1 + d2)^2 s2 / g + 2 s2^2 / (g (g - 1)) for g groups of variance s2 and differences d1, d2 from
  // the two references. Both terms are products of estimates from two disjoint pairs of groups, hence unbiased however
  // the values scatter: with ghosts they are rare and bright, far from normal.
  static_assert(kTruthGroups == 4, "pairs of groups are paired off below");
  constexpr int pairings[3][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};
  double linear = 0, square = 0;
  for (const auto& [i, j, k, l] : pairings) {
    const auto both = [&](int m, int n) { return (2 * seen[m] - o1 - o2) * (2 * seen[n] - o1 - o2); };
    const auto scatter = [&](int m, int n) { return 0.5 * (seen[m] - seen[n]) * (seen[m] - seen[n]); };
    const double one = scatter(i, j), other = scatter(k, l);
    linear += (both(i, j) * other + both(k, l) * one) / 6;
    square += one * other / 3;
  }
  sum.variance += linear / groups + 2 * square / (groups * (groups - 1));
}

MseEstimate Camera::noise_free_mse(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                                   const Reference& reference) {
  place(lens, true_pose);
  if (diffraction_) {
    if (!diffracted_truth_)
      diffracted_truth_ = std::make_unique<DiffractedTruth>(*diffraction_, scene_->sensor.width, scene_->sensor.height);
    for (int group = 0; group < kTruthGroups; ++group)
      render_rays(seed, static_cast<std::uint32_t>(group), kTruthSamples, kTruthGhosts,
                  diffracted_truth_->group(group));
    return diffracted_truth_->estimate(reference, *parallel_);
  }
  const RayPath way = this->way();
  const int width = scene_->sensor.width;
  constexpr int groups = kTruthGroups;
  parallel_->for_each(static_cast<int>(tiles_.tiles().size()), [&](int index, unsigned thread) {
    const Tile& tile = tiles_.tiles()[static_cast<std::size_t>(index)];
    Workspace& work = *workspaces_[thread];
    double scale = 0;
    if (!tile.blind) {
      scale = tile.area / kTruthSamples;
      for (int group = 0; group < groups; ++group) {
        work.source.start_tile(*scene_, path_, tile, tile.seen, work.sums[group]);
        work.source.lattice_directions(way, seed, static_cast<std::uint32_t>(group), kTruthSamples);
      }
    }
    if (ghosts_)
      for (int group = 0; group < groups; ++group)
        ghosts_->ghost_part(tile.box, seed, static_cast<std::uint32_t>(group), kTruthGhosts, work.paths,
                            work.ghosts[group]);
    TileSum sum;
    int ghost_at = 0;
    for (int row = tile.box.row; row < tile.box.row + tile.box.rows; ++row)
      for (int column = tile.box.column; column < tile.box.column + tile.box.columns; ++column) {
        const auto at = static_cast<std::size_t>(row * width + column);
        // Where among the tile's sums; negative: this pixel sees nothing.
        const int sum_at = tile.blind ? -1 : place_in(tile.seen, column, row);
        const double o1 = static_cast<double>(reference.first[at]), o2 = static_cast<double>(reference.second[at]);
        double seen[kTruthGroups];
        for (int group = 0; group < groups; ++group) {
          const double direct = sum_at < 0 ? 0 : scale * static_cast<double>(work.sums[group][sum_at]);
          seen[group] = direct + (ghosts_ ? static_cast<double>(work.ghosts[group][ghost_at]) : 0);
        }
        ++ghost_at;
        add_truth(seen, o1, o2, sum);
      }
    sums_[static_cast<std::size_t>(index)] = sum;
  });
  double product = 0, variance = 0;
  for (const TileSum& sum : sums_) {
    product += sum.product;
    variance += sum.variance;
  }
  const auto count = static_cast<double>(scene_->sensor.pixels());
  return {product / count, std::sqrt(std::max(0.0, variance)) / count};
}

}  // namespace relign::imaging
