#include "gpu/capture_batch.h"

#include "base/error.h"
#include "imaging/pupil_tiles.h"
#include "imaging/read_out.h"
#include "optics/backward_path.h"

namespace relign::gpu {

static_assert(kTileThreads >= imaging::kTilePixels * imaging::kTilePixels);

std::string unsupported(const imaging::SceneFile& scene, const imaging::CaptureSettings& settings) {
  const std::string start = "scene '" + scene.name + "': the GPU simulator does not support ";
  if (settings.sampler != imaging::Sampler::paper) return start + "samplers other than 'paper'";
  if (settings.scored_tiles != 1) return start + "'scored_tiles' other than 1";
  if (!scene.wavelengths.empty()) return start + "several 'wavelengths'";
  if (scene.diffraction) return start + "'diffraction'";
  if (!scene.sensor.windows.empty()) return start + "a sensor with windows";
  for (const optics::Element& element : scene.lens.elements)
    for (std::size_t f = 0; f < element.faces.size(); ++f)
      if (!element.faces[f].is_conic())
        return start + "polynomial faces, such as face " + std::to_string(f + 1) + " of " + element.name;
  return "";
}

struct CaptureBatch::Fitter {
  Parallel alone{1};
  std::optional<imaging::PupilTiles> tiles;  // none if kernels fit them
  std::optional<imaging::GhostImage> ghosts;
  optics::BackwardPath path;
  std::optional<imaging::DrawnErrors> errors;
};

CaptureBatch::CaptureBatch(const imaging::SceneFile& scene, const imaging::CaptureSettings& settings,
                           Parallel& parallel, const imaging::DrawnErrors* errors, Tiles tiles)
    : scene_(&scene), settings_(settings), parallel_(&parallel) {
  if (const std::string problem = unsupported(scene, settings); !problem.empty())
    throw Error(ErrorKind::bad_input, problem);
  search_ = scene.pupil;
  if (!search_) search_ = std::make_shared<optics::PupilSearch>(imaging::search_pupil(scene, scene.lens));
  by_kernels_ = tiles == Tiles::fitted_by_kernels && search_->grid().on_plane && !has_ghosts();
  for (unsigned thread = 0; thread < parallel.threads(); ++thread) {
    fitters_.push_back(std::make_unique<Fitter>());
    if (has_ghosts())
      fitters_.back()->ghosts.emplace(scene, settings.sensor_albedo);
    else if (!by_kernels_)
      fitters_.back()->tiles.emplace(scene, fitters_.back()->alone);
    if (errors) fitters_.back()->errors = *errors;
  }
}

CaptureBatch::~CaptureBatch() = default;

void CaptureBatch::clear(Errors& errors) {
  errors.jobs.clear();
  errors.values.clear();
  errors.rings.clear();
  errors.hot_pixels.clear();
}

void CaptureBatch::clear(Ghosts& ghosts) {
  ghosts.boxes.clear();
  ghosts.lenses.clear();
  ghosts.steps.clear();
  ghosts.bodies.clear();
  ghosts.stops.clear();
}

void CaptureBatch::set_ghosts(imaging::GhostImage& image, const imaging::BatchItem& item,
                              const std::optional<optics::Motion>& into_print, Jobs& jobs) const {
  image.place(item.lens->assembly(), jobs.fit.lens_to_world, into_print);
  const imaging::GhostScene& placed = image.placed();
  jobs.ops = {placed.to_world, placed.to_print};
  if (placed.has_bore) jobs.ops.push_back(placed.bore);
  jobs.image.ops = static_cast<std::int32_t>(jobs.ops.size());
  const optics::GhostTables& tables = placed.tables;
  jobs.ghosts.steps = tables.steps();
  jobs.ghosts.bodies = tables.bodies();
  jobs.ghosts.stops = tables.stops();
  GhostLensJob lens{tables.lens(), 0, 0, 0, tables.entrance()};
  lens.lens.bodies = nullptr;
  lens.lens.stops = nullptr;
  jobs.ghosts.lenses.push_back(lens);
  for (const imaging::PixelBox& box : image.boxes()) {
    double area = 0;
    const imaging::GhostBlocks::Box from = image.box_of(box, item.seed, area);
    GhostBoxJob job{};
    job.start = from.start;
    job.places = imaging::places_of(box, box, rays_.frame_width);
    job.pixels = box.columns * box.rows;
    job.whole_disc = from.hemisphere ? 1 : 0;
    job.first_threshold = static_cast<std::int64_t>(jobs.thresholds.size());
    job.centre_x = from.centre.x;
    job.centre_y = from.centre.y;
    if (!from.hemisphere) {
      const auto first = jobs.thresholds.size();
      jobs.thresholds.resize(first + static_cast<std::size_t>(rays_.samples));
      job.thresholds = imaging::binomial_thresholds(rays_.samples, area / optics::kPi, jobs.thresholds.data() + first);
      jobs.thresholds.resize(first + static_cast<std::size_t>(job.thresholds));
    }
    jobs.ghosts.boxes.push_back(job);
  }
}

void CaptureBatch::add_ghosts(const Ghosts& ghosts) {
  const auto number = [](std::size_t size) { return static_cast<std::int32_t>(size); };
  for (GhostLensJob lens : ghosts.lenses) {
    lens.first_step = number(ghosts_.steps.size());
    lens.first_body = number(ghosts_.bodies.size());
    lens.first_stop = number(ghosts_.stops.size());
    ghosts_.lenses.push_back(lens);
  }
  for (GhostBoxJob box : ghosts.boxes) {
    box.image = number(images_.size());
    box.first_threshold += static_cast<std::int64_t>(thresholds_.size());
    ghosts_.boxes.push_back(box);
  }
  ghosts_.steps.insert(ghosts_.steps.end(), ghosts.steps.begin(), ghosts.steps.end());
  ghosts_.bodies.insert(ghosts_.bodies.end(), ghosts.bodies.begin(), ghosts.bodies.end());
  ghosts_.stops.insert(ghosts_.stops.end(), ghosts.stops.begin(), ghosts.stops.end());
}

void CaptureBatch::set_errors(const imaging::DrawnErrors& drawn, Errors& errors) {
  ErrorJob job{};
  job.levels = drawn.levels();
  errors.values = drawn.weights();
  job.reach = static_cast<std::int32_t>(errors.values.size()) - 1;
  job.first_node = -1;
  if (const imaging::StrayLight* const light = drawn.stray_light()) {
    job.first_node = static_cast<std::int32_t>(errors.values.size());
    errors.values.insert(errors.values.end(), light->nodes().begin(), light->nodes().end());
    job.stray_light = light->levels();
    errors.rings = light->rings();
    job.rings = static_cast<std::int32_t>(errors.rings.size());
  }
  drawn.for_hot_pixels([&](std::uint64_t pixel) { errors.hot_pixels.push_back(static_cast<std::uint32_t>(pixel)); });
  job.hot_pixels = static_cast<std::int32_t>(errors.hot_pixels.size());
  errors.jobs.push_back(job);
}

void CaptureBatch::add_errors(const Errors& errors) {
  const auto first = [](const auto& list) { return static_cast<std::int32_t>(list.size()); };
  ErrorJob job = errors.jobs.front();
  job.first_weight = first(errors_.values);
  if (job.first_node >= 0) job.first_node += first(errors_.values);
  job.first_ring = first(errors_.rings);
  job.first_hot_pixel = first(errors_.hot_pixels);
  if (job.reach > 0) job.rows = static_cast<std::int32_t>(blurred_images_++);
  errors_.jobs.push_back(job);
  errors_.values.insert(errors_.values.end(), errors.values.begin(), errors.values.end());
  errors_.rings.insert(errors_.rings.end(), errors.rings.begin(), errors.rings.end());
  errors_.hot_pixels.insert(errors_.hot_pixels.end(), errors.hot_pixels.begin(), errors.hot_pixels.end());
}

void CaptureBatch::set_jobs(Fitter& fitter, const imaging::BatchItem& item, Kind kind, Jobs& jobs) const {
  const optics::Motion lens_to_world = scene_->lens_to_world(*item.true_pose);
  optics::BackwardPath& path = fitter.path;
  optics::set_backward_path(path, item.lens->assembly(), lens_to_world);
  jobs.ops.assign(path.ops.begin(), path.ops.end());
  clear(jobs.errors);
  std::optional<optics::Motion> into_print;
  if (kind == Kind::capture && fitter.errors && fitter.errors->draw(item.seed)) {
    into_print = fitter.errors->into_print();
    set_errors(*fitter.errors, jobs.errors);
  }
  jobs.ops.push_back(optics::last_frame_to_world(path, into_print));
  const bool fresnel = settings_.transport != imaging::Transport::refract;
  const double highest = fresnel ? path.highest_transmittance : 1.0;
  jobs.image = {static_cast<std::uint32_t>(item.seed),
                static_cast<std::uint32_t>(item.seed >> 32),
                0,
                static_cast<std::int32_t>(jobs.ops.size()),
                static_cast<float>(highest),
                0,
                -1};
  jobs.fit = {lens_to_world,
              optics::inverse(lens_to_world),
              path.into_first_frame,
              item.lens->table().path().into_first_frame,
              highest,
              nullptr,
              nullptr,
              0,
              static_cast<std::int32_t>(path.through_aperture)};
  jobs.tiles.clear();
  jobs.thresholds.clear();
  clear(jobs.ghosts);
  if (fitter.tiles) fit_tiles(fitter, item, jobs);
  if (fitter.ghosts) set_ghosts(*fitter.ghosts, item, into_print, jobs);
}

void CaptureBatch::fit_tiles(Fitter& fitter, const imaging::BatchItem& item, Jobs& jobs) const {
  fitter.tiles->fit(*item.lens, jobs.fit.lens_to_world, fitter.path, jobs.ops, scene_->emitter.plane());
  for (const imaging::Tile& tile : fitter.tiles->tiles()) {
    if (tile.unlit && rays_.captures) continue;
    const std::size_t first = jobs.thresholds.size();
    jobs.thresholds.resize(first + static_cast<std::size_t>(rays_.captures ? rays_.samples : 0));
    TileJob job;
    set_tile_job(tile, rays_, jobs.fit.highest_transmittance, job, jobs.thresholds.data() + first);
    job.first_threshold = static_cast<std::int64_t>(first);
    jobs.thresholds.resize(first + static_cast<std::size_t>(job.thresholds));
    jobs.tiles.push_back(job);
  }
}

void CaptureBatch::prepare(const std::vector<imaging::BatchItem>& items, Kind kind,
                           const std::vector<std::uint32_t>& places) {
  if (kind == Kind::noise_free_mse && has_ghosts())
    throw Error(ErrorKind::bad_input, "scene '" + scene_->name +
                                          "': the GPU simulator does not support noise-free MSE of transport 'ghost'; "
                                          "use the CPU's");
  if (jobs_.size() < items.size()) jobs_.resize(items.size());
  const imaging::Sensor& sensor = scene_->sensor;
  rays_ = {kind == Kind::capture ? 1 : 0,
           kind == Kind::capture ? settings_.samples : imaging::mse_samples(static_cast<double>(sensor.pixels())),
           sensor.width};
  parallel_->for_each(static_cast<int>(items.size()), [&](int index, unsigned thread) {
    const auto at = static_cast<std::size_t>(index);
    set_jobs(*fitters_[thread], items[at], kind, jobs_[at]);
  });
  tiles_.clear();
  images_.clear();
  fits_.clear();
  lenses_.clear();
  ops_.clear();
  thresholds_.clear();
  clear(errors_);
  clear(ghosts_);
  blurred_images_ = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Jobs& jobs = jobs_[i];
    for (TileJob tile : jobs.tiles) {
      tile.image = static_cast<std::int32_t>(i);
      tile.first_threshold += static_cast<std::int64_t>(thresholds_.size());
      tiles_.push_back(tile);
    }
    add_ghosts(jobs.ghosts);
    fits_.push_back(jobs.fit);
    lenses_.push_back(items[i].lens->identity());
    images_.push_back(jobs.image);
    images_.back().first_op = static_cast<std::int32_t>(ops_.size());
    images_.back().place = places.empty() ? static_cast<std::uint32_t>(i) : places[i];
    if (!jobs.errors.jobs.empty()) {
      images_.back().errors = static_cast<std::int32_t>(errors_.jobs.size());
      add_errors(jobs.errors);
    }
    ops_.insert(ops_.end(), jobs.ops.begin(), jobs.ops.end());
    thresholds_.insert(thresholds_.end(), jobs.thresholds.begin(), jobs.thresholds.end());
  }
}

FitBatch CaptureBatch::fit_batch() const {
  const optics::EmitterPlane emitter = scene_->emitter.plane();
  FitBatch batch{};
  batch.image_count = static_cast<std::int32_t>(images_.size());
  batch.rays = rays_;
  batch.grid = imaging::tile_grid(scene_->sensor);
  batch.places = search_->grid();
  batch.azimuths = optics::azimuths();
  batch.distance_z = emitter.distance_z;
  batch.half_emitter = emitter.half_side;
  return batch;
}

std::size_t CaptureBatch::tile_count() const {
  if (!by_kernels_) return tiles_.size();
  return images_.size() * static_cast<std::size_t>(imaging::tile_grid(scene_->sensor).tiles());
}

Batch CaptureBatch::batch(const imaging::Reference* reference) const {
  const auto pixels = scene_->sensor.pixels();
  return {tiles_.data(),
          images_.data(),
          ops_.data(),
          thresholds_.data(),
          scene_->emitter.plane(),
          settings_.transport != imaging::Transport::refract ? 1 : 0,
          static_cast<std::int32_t>(pixels),
          imaging::mse_samples(static_cast<double>(pixels)),
          reference ? reference->first.data() : nullptr,
          reference ? reference->second.data() : nullptr,
          reference ? reference->mean.data() : nullptr};
}

GhostBatch CaptureBatch::ghost_batch() const {
  int most_pixels = 0;
  for (const GhostBoxJob& box : ghosts_.boxes) most_pixels = std::max(most_pixels, box.pixels);
  return {ghosts_.boxes.data(),
          ghosts_.lenses.data(),
          ghosts_.steps.data(),
          ghosts_.bodies.data(),
          ghosts_.stops.data(),
          scene_->sensor,
          static_cast<float>(settings_.sensor_albedo),
          scene_->lens.barrel ? 1 : 0,
          settings_.samples,
          (most_pixels + kTileThreads - 1) / kTileThreads};
}

ErrorBatch CaptureBatch::error_batch() const {
  const imaging::Sensor& sensor = scene_->sensor;
  ErrorBatch batch{};
  batch.jobs = errors_.jobs.data();
  batch.values = errors_.values.data();
  batch.rings = errors_.rings.data();
  batch.hot_pixels = errors_.hot_pixels.data();
  batch.width = sensor.width;
  batch.height = sensor.height;
  if (sensor.electronics) batch.electronics = imaging::read_out_of(*sensor.electronics, imaging::ShotNoise::sampled);
  return batch;
}

std::vector<float> CaptureBatch::capture_here() const {
  const Batch here = batch();
  ErrorBatch errors = error_batch();
  const std::size_t pixels = scene_->sensor.pixels();
  std::vector<float> images(images_.size() * pixels), rows(blurred_images_ * pixels);
  errors.rows = rows.data();
  for (const TileJob& tile : tiles_)
    for (std::int32_t pixel = 0; pixel < tile.lit_pixels; ++pixel) capture_pixel(here, tile, pixel, images.data());
  const GhostBatch ghosts = ghost_batch();
  for (const GhostBoxJob& box : ghosts_.boxes)
    for (std::int32_t pixel = 0; pixel < box.pixels; ++pixel) ghost_pixel(here, ghosts, box, pixel, images.data());
  if (errors.electronics.present)
    for (std::size_t i = 0; i < images.size(); ++i)
      read_out_pixel(here, errors, static_cast<std::int64_t>(i), images.data());
  for (const ImageJob& image : images_) read_out_image(optics::OneThread(), here, errors, image, images.data());
  return images;
}

std::vector<imaging::MseEstimate> CaptureBatch::mse_here(const imaging::Reference& reference) const {
  const Batch here = batch(&reference);
  std::vector<imaging::MseSum> sums(tiles_.size());
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    for (std::int32_t pixel = 0; pixel < tiles_[i].pixels; ++pixel) sums[i] += mse_pixel(here, tiles_[i], pixel);
  return estimates(sums);
}

std::vector<imaging::MseEstimate> CaptureBatch::estimates(const std::vector<imaging::MseSum>& sums) const {
  std::vector<imaging::MseSum> of_images(images_.size());
  const std::size_t tiles_of_image = sums.size() / std::max<std::size_t>(1, images_.size());  // an MSE is of all tiles
  for (std::size_t i = 0; i < sums.size(); ++i) of_images[i / tiles_of_image] += sums[i];
  std::vector<imaging::MseEstimate> all;
  const auto count = static_cast<double>(scene_->sensor.pixels());
  for (const imaging::MseSum& sum : of_images) all.push_back(imaging::estimate_of(sum, count));
  return all;
}

}  // namespace relign::gpu
