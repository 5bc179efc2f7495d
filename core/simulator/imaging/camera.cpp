#include "imaging/camera.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <relign/random.hpp>

#include "base/error.h"
#include "imaging/camera_workspace.h"
#include "imaging/diffracted_mse.h"
#include "imaging/read_out.h"
#include "imaging/sequences.h"
#include "imaging/streams.h"

namespace relign::imaging {
namespace {

using optics::kPi;

// Features that support only one wavelength.
void refuse_wavelengths(const SceneFile& scene, const CaptureSettings& settings, bool traced) {
  const std::size_t count = scene.wavelengths.size();
  if (count == 0) return;
  const std::string several = "scene '" + scene.name + "': 'wavelengths' lists " + std::to_string(count);
  if (traced)
    throw Error(ErrorKind::bad_input,
                several + ", but a lens of meshes is traced at one; list one, or use 'lens_system'");
  if (settings.transport == Transport::ghost)
    throw Error(ErrorKind::bad_input, several + ", but transport 'ghost' supports one; use transport 'fresnel'");
}

void refuse_warp(const SceneFile& scene, const CaptureSettings& settings) {
  if (scene.sensor.bow_per_mm != 0 && settings.transport == Transport::ghost)
    throw Error(ErrorKind::bad_input,
                "scene '" + scene.name +
                    "': 'sensor_warp' bends the sensor, but transport 'ghost' needs a flat one; use "
                    "transport 'fresnel', or leave out 'sensor_warp'");
}

// What a whole capture reads out.
PixelRegions windows_of(const Sensor& sensor) {
  const auto count = [](int pixels) { return static_cast<std::uint32_t>(pixels); };
  if (sensor.windows.empty()) return {{0, 0, count(sensor.width), count(sensor.height)}};
  PixelRegions windows;
  for (const PixelBox& window : sensor.windows)
    windows.push_back({count(window.column), count(window.row), count(window.columns), count(window.rows)});
  return windows;
}

// The parts of the regions that are in windows.
PixelRegions inside(const PixelRegions& windows, const PixelRegions& regions) {
  PixelRegions parts;
  for (const PixelRegion& window : windows)
    for (const PixelRegion& region : regions) {
      const std::uint32_t left = std::max(window.column, region.column), top = std::max(window.row, region.row);
      const std::uint32_t right = std::min(window.column + window.columns, region.column + region.columns);
      const std::uint32_t bottom = std::min(window.row + window.rows, region.row + region.rows);
      if (left < right && top < bottom) parts.push_back({left, top, right - left, bottom - top});
    }
  return parts;
}

double pixels_of(const std::vector<PixelSpan>& spans) {
  double pixels = 0;
  for (const PixelSpan& span : spans) pixels += static_cast<double>(span.count);
  return pixels;
}

constexpr std::uint32_t kStreamsPerView = 32;  // of a frame seed; the first view and the read-out use those below

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
  if (name == "lattice") return Sampler::lattice;
  return std::nullopt;
}

int mse_samples(double pixels_read_out) {
  return pixels_read_out > kMsePixels ? static_cast<int>(std::ceil(kMseSamples * kMsePixels / pixels_read_out))
                                      : kMseSamples;
}

MseEstimate estimate_of(const MseSum& sum, double pixels) {
  return {sum.product / pixels, std::sqrt(std::max(0.0, sum.variance)) / pixels};
}

Camera::Camera(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel, optics::BlockTracer* tracer)
    : scene_(&scene), settings_(settings), parallel_(&parallel), tracer_(tracer) {
  refuse_wavelengths(scene, settings, tracer != nullptr);
  refuse_warp(scene, settings);
  views_.emplace_back(scene, parallel);
  for (std::size_t i = 0; i < scene.wavelengths.size(); ++i) {
    if (i > 0) views_.emplace_back(scene, parallel);
    views_[i].which = i + 1;
    views_[i].weight = scene.wavelengths[i].weight;
    views_[i].streams = kStreamsPerView * static_cast<std::uint32_t>(i);
  }
  set_capture(settings.sampler, settings.samples);
  for (unsigned thread = 0; thread < parallel.threads(); ++thread) workspaces_.push_back(std::make_unique<Workspace>());
  spans_ = spans_of(windows_of(scene.sensor), static_cast<std::size_t>(scene.sensor.width));
  choose_scored_tiles();
  mse_samples_ = mse_samples(share_read_out() * static_cast<double>(scene.sensor.pixels()));
  mse_shares_ = allocate_samples(mse_samples_);
  emitter_ = scene.emitter.plane();
  if (scene.diffraction) diffraction_.emplace(scene);
  if (settings.transport != Transport::ghost) return;
  ghosts_.emplace(scene, settings.sensor_albedo);
  for (std::vector<float>& image : with_ghosts_) image.resize(scene.sensor.pixels());
}

Camera::~Camera() = default;

void Camera::choose_scored_tiles() {
  const auto pixels = [](const Tile& tile) { return static_cast<double>(tile.box.columns * tile.box.rows); };
  const auto every = static_cast<std::uint32_t>(settings_.scored_tiles);
  if (every > 1 && (settings_.transport == Transport::ghost || scene_->diffraction))
    throw Error(ErrorKind::bad_input, "scene '" + scene_->name + "': its noise-free RMSE needs whole images (" +
                                          (scene_->diffraction ? "diffraction" : "transport 'ghost'") +
                                          "); use 'scored_tiles' 1, found " + std::to_string(every));
  constexpr std::uint32_t kKey = 0x5C02ED;
  double all = 0, scored = 0;
  for (std::size_t i = 0; i < tiles().size(); ++i) {
    all += pixels(tiles()[i]);
    const auto index = static_cast<std::uint32_t>(i);
    if (philox4x32({index, 0, 0, 0}, {kKey, 0})[0] % every != 0 && !(scored_.empty() && i + 1 == tiles().size()))
      continue;
    scored_.push_back(static_cast<int>(i));
    scored += pixels(tiles()[i]);
  }
  pixels_per_scored_ = all / scored;
  sums_.resize(scored_.size());
}

double Camera::share_read_out() const { return pixels_of(spans_) / static_cast<double>(scene_->sensor.pixels()); }

void Camera::set_capture(Sampler sampler, int samples) {
  if (samples < static_cast<int>(views_.size()))
    throw Error(ErrorKind::bad_input, "scene '" + scene_->name + "': each of its " + std::to_string(views_.size()) +
                                          " wavelengths needs a sample per pixel, found 'samples' " +
                                          std::to_string(samples) + "; raise 'samples' or list fewer wavelengths");
  settings_.sampler = sampler;
  settings_.samples = samples;
  capture_shares_ = allocate_samples(samples);
}

std::vector<int> Camera::allocate_samples(int samples) const {
  std::vector<double> weights;
  for (const View& view : views_) weights.push_back(view.weight);
  return imaging::allocate_samples(std::max(samples, static_cast<int>(views_.size())), weights);
}

void Camera::place(MountedLens& lens, const std::vector<double>& true_pose,
                   const std::optional<optics::Motion>& into_print, const PixelRegions& regions) {
  if (tracer_ && into_print)
    throw Error(ErrorKind::bad_input,
                "scene '" + scene_->name + "': a lens of meshes supports no errors of the target");
  const optics::Motion lens_to_world = scene_->lens_to_world(true_pose);
  if (ghosts_) ghosts_->place(lens.assembly(), lens_to_world, into_print);
  std::vector<PixelBox> boxes;
  for (const PixelRegion& region : regions)
    boxes.push_back({static_cast<int>(region.column), static_cast<int>(region.row), static_cast<int>(region.columns),
                     static_cast<int>(region.rows)});
  for (View& view : views_) {
    view.tiles.select(boxes);
    optics::set_backward_path(view.path, lens.assembly(view.which), lens_to_world);
    view.ops.assign(view.path.ops.begin(), view.path.ops.end());
    view.ops.push_back(optics::last_frame_to_world(view.path, into_print));
    view.tiles.fit(lens, lens_to_world, view.path, view.ops, emitter_, view.which);
  }
  if (tracer_) tracer_->place(lens.assembly(), lens_to_world, views_.front().path);
}

int Camera::certify(MountedLens& lens, const std::vector<double>& true_pose, const CertificateRays& rays,
                    std::uint64_t seed) {
  place(lens, true_pose);
  int arrived = 0;
  for (const View& view : views_)
    arrived += imaging::certify(*scene_, view.tiles, view.path, view.ops, lens.table(view.which).search(),
                                scene_->lens_to_world(true_pose), tracer_, rays, seed, *parallel_,
                                view.which > 0 ? lens.assembly(view.which).lens().wavelength_nm : 0);
  return arrived;
}

RayPath Camera::ray_path(const View& view) const {
  const bool fresnel = settings_.transport != Transport::refract;
  return {view.ops.data(),
          static_cast<int>(view.ops.size()),
          &emitter_,
          fresnel,
          fresnel ? view.path.highest_transmittance : 1.0,
          tracer_,
          view.streams};
}

void Camera::render_tiles(std::uint64_t seed, std::uint32_t group, int samples, float* pixels, float* derivatives) {
  // The hemisphere sampler assumes nothing of tiles.
  const bool all = samples == 0 && settings_.sampler == Sampler::hemisphere;
  std::vector<int> of_render;  // captures do not allocate
  if (samples > 0) of_render = allocate_samples(samples);
  const std::vector<int>& shares = samples > 0 ? of_render : capture_shares_;
  const int width = scene_->sensor.width;
  const std::vector<std::size_t>& selected = views_.front().tiles.selected();  // the same in all views
  if (!scene_->sensor.windows.empty() && selected.size() == tiles().size())
    std::fill_n(pixels, scene_->sensor.pixels(), 0.0F);
  parallel_->for_each(static_cast<int>(selected.size()), [&](int index, unsigned thread) {
    const std::size_t at = selected[static_cast<std::size_t>(index)];
    Workspace& work = *workspaces_[thread];
    fill_with_black(tiles()[at].box, width, pixels);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Tile& tile = views_[i].tiles.tiles()[at];
      if (!all && tile.unlit) continue;
      const PixelBox& box = all ? tile.box : tile.lit;
      work.start(*scene_, views_[i], tile, box, derivatives != nullptr);
      const double scale = views_[i].weight * draw_rays(work.source, views_[i], tile, seed, group, samples, shares[i]);
      add_to_pixels(box, work.sums, scale, width, pixels);
      if (derivatives) work.derivatives.add_to_frame(box, scale, width, derivatives);
    }
  });
}

void Camera::capture_ghosts(std::uint64_t seed, float* pixels) {
  parallel_->for_each(static_cast<int>(ghosts_->boxes().size()), [&](int index, unsigned thread) {
    const PixelBox& box = ghosts_->boxes()[static_cast<std::size_t>(index)];
    if (settings_.sampler == Sampler::hemisphere)
      ghosts_->capture_everywhere(box, seed, settings_.samples, pixels);
    else
      ghosts_->capture(box, seed, settings_.samples, workspaces_[thread]->paths, pixels);
  });
}

void Camera::add_ghosts(std::uint64_t seed, std::uint32_t group, int samples, float* pixels) {
  if (!ghosts_) return;
  straight_.assign(pixels, pixels + scene_->sensor.pixels());
  parallel_->for_each(static_cast<int>(ghosts_->boxes().size()), [&](int index, unsigned thread) {
    ghosts_->add_ghosts(ghosts_->boxes()[static_cast<std::size_t>(index)], seed, group, samples, straight_.data(),
                        workspaces_[thread]->paths, pixels);
  });
}

void Camera::capture(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, float* pixels,
                     const std::optional<optics::Motion>& into_print) {
  place(lens, true_pose, into_print);
  render_light(seed, pixels);
  add_diffraction(pixels);
  read_out_spans(spans_, seed, pixels);
}

double Camera::capture_regions(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed,
                               const PixelRegions& regions, float* pixels) {
  if (!captures_regions())
    throw Error(ErrorKind::internal, "regions of images with diffraction or transport ghost depend on other pixels");
  const auto width = static_cast<std::size_t>(scene_->sensor.width);
  place(lens, true_pose, std::nullopt, regions);
  for (const PixelSpan& span : spans_of(regions, width)) std::fill_n(pixels + span.first, span.count, 0.0F);
  render_light(seed, pixels);
  const std::vector<PixelSpan> spans = spans_of(inside(windows_of(scene_->sensor), regions), width);
  read_out_spans(spans, seed, pixels);
  return pixels_of(spans) / pixels_of(spans_);
}

void Camera::read_out_spans(const std::vector<PixelSpan>& spans, std::uint64_t seed, float* pixels) {
  if (!scene_->sensor.electronics) return;
  const bool photons = settings_.sampler == Sampler::paper || settings_.sampler == Sampler::hemisphere;
  const ShotNoise shot_noise = photons ? ShotNoise::sampled : ShotNoise::added;
  parallel_->for_each(static_cast<int>(spans.size()), [&](int index, unsigned thread) {
    const PixelSpan& span = spans[static_cast<std::size_t>(index)];
    read_out(*scene_->sensor.electronics, shot_noise, seed, static_cast<int>(span.first), static_cast<int>(span.count),
             pixels + span.first, workspaces_[thread]->words);
  });
}

void Camera::render_light(std::uint64_t seed, float* pixels) {
  if (ghosts_ && (settings_.sampler == Sampler::paper || settings_.sampler == Sampler::hemisphere)) {
    capture_ghosts(seed, pixels);
    return;
  }
  render_tiles(seed, 0, 0, pixels);
  if (settings_.sampler == Sampler::pupil || settings_.sampler == Sampler::lattice)
    add_ghosts(seed, 0, settings_.samples, pixels);
}

void Camera::render_noise_free(MountedLens& lens, const std::vector<double>& true_pose, std::uint64_t seed, int samples,
                               float* pixels, int rays_per_ghost) {
  place(lens, true_pose);
  render_rays(seed, 0, samples, std::max(1, samples / rays_per_ghost), pixels);
  add_diffraction(pixels);
}

NoiseFreeResult Camera::render_noise_free(MountedLens& lens, const std::vector<double>& true_pose,
                                          const NoiseFreeRequest& request, float* pixels) {
  constexpr std::uint32_t kFirstGroup = 256;  // MSE estimates and references use those below
  place(lens, true_pose);
  const std::size_t count = scene_->sensor.pixels();
  const int batch =
      request.samples > 0
          ? static_cast<int>(std::clamp<long>((request.samples + kMinBatches - 1) / kMinBatches, 1, request.batch))
          : request.batch;
  std::vector<double> sum(count), squares(count);
  NoiseFreeResult reached;
  long batches = kMinBatches;
  if (request.samples > 0) batches = std::max<long>(batches, (request.samples + batch - 1) / batch);
  for (long done = 0; done < batches;) {
    for (; done < batches; ++done) {
      render_rays(request.seed, kFirstGroup + static_cast<std::uint32_t>(done), batch,
                  std::max(1, batch / request.rays_per_ghost), pixels);
      add_diffraction(pixels);
      for (std::size_t i = 0; i < count; ++i) {
        const auto value = static_cast<double>(pixels[i]);
        sum[i] += value;
        squares[i] += value * value;
      }
    }
    const auto n = static_cast<double>(batches);
    double variance = 0;
    for (std::size_t i = 0; i < count; ++i) variance += std::max(0.0, squares[i] - sum[i] * sum[i] / n) / (n - 1) / n;
    reached = {std::sqrt(variance / static_cast<double>(count)), batches * batch};
    if (request.samples > 0 || reached.standard_error <= request.error || batches >= request.most_batches) break;
    // As many batches as this scatter requires, plus 5 %, since the scatter is an estimate too.
    const double share = reached.standard_error / request.error;
    batches =
        static_cast<long>(std::min(std::ceil(1.05 * n * share * share), static_cast<double>(request.most_batches)));
  }
  for (std::size_t i = 0; i < count; ++i) pixels[i] = static_cast<float>(sum[i] / static_cast<double>(batches));
  return reached;
}

double Camera::draw_rays(RaySource& source, const View& view, const Tile& tile, std::uint64_t seed, std::uint32_t group,
                         int samples, int share) const {
  const RayPath path = ray_path(view);
  if (samples > 0 || settings_.sampler == Sampler::lattice) {
    source.lattice_directions(path, seed, group, share);
    return tile.area / share;
  }
  if (settings_.sampler == Sampler::pupil) {
    source.random_directions(path, seed, share);
    return tile.area / share;
  }
  if (settings_.sampler == Sampler::hemisphere)
    source.all_directions(path, seed, share, kRouletteSurvival);
  else
    source.binomial_directions(path, seed, share, kRouletteSurvival);
  return kPi / share / kRouletteSurvival;
}

void Camera::render_rays(std::uint64_t seed, std::uint32_t group, int samples, int ghosts, float* pixels) {
  render_tiles(seed, group, samples, pixels);
  add_ghosts(seed, group, ghosts, pixels);
}

void Camera::add_diffraction(float* pixels) {
  if (diffraction_) diffraction_->blur(pixels, pixels, *parallel_, blurring_);
}

}  // namespace relign::imaging
