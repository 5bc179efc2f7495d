#include "gpu/capture_batch.h"

#include "base/error.h"
#include "imaging/pupil_tiles.h"
#include "imaging/read_out.h"
#include "imaging/sequences.h"
#include "optics/backward_path.h"

namespace relign::gpu {

static_assert(kTileThreads >= imaging::kTilePixels * imaging::kTilePixels);

std::string unsupported(const imaging::SceneFile& scene, const imaging::CaptureSettings& settings) {
  const std::string start = "scene '" + scene.name + "': the GPU simulator does not support ";
  if (settings.transport == imaging::Transport::ghost) return start + "transport 'ghost'; use 'fresnel' or 'refract'";
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
  Fitter(const imaging::SceneFile& scene, const imaging::DrawnErrors* drawn) : tiles(scene, alone) {
    if (drawn) errors = *drawn;
  }
  Parallel alone{1};
  imaging::PupilTiles tiles;
  optics::BackwardPath path;
  std::optional<imaging::DrawnErrors> errors;
};

CaptureBatch::CaptureBatch(const imaging::SceneFile& scene, const imaging::CaptureSettings& settings,
                           Parallel& parallel, const imaging::DrawnErrors* errors)
    : scene_(&scene), settings_(settings), parallel_(&parallel) {
  if (const std::string problem = unsupported(scene, settings); !problem.empty())
    throw Error(ErrorKind::bad_input, problem);
  for (unsigned thread = 0; thread < parallel.threads(); ++thread)
    fitters_.push_back(std::make_unique<Fitter>(scene, errors));
}

CaptureBatch::~CaptureBatch() = default;

// The distribution of the number of rays of a pixel, as in RaySource::draw_counts.
void CaptureBatch::add_thresholds(const imaging::Tile& tile, double highest_transmittance, TileJob& job,
                                  Jobs& jobs) const {
  const auto samples = static_cast<std::size_t>(settings_.samples);
  const double largest_survival = imaging::kRouletteSurvival * highest_transmittance;
  const double probability = tile.area / optics::kPi * largest_survival;
  const std::size_t first = jobs.thresholds.size();
  jobs.thresholds.resize(first + samples);  // all 0, which every word reaches: all samples are traced
  job.first_threshold = static_cast<std::int32_t>(first);
  job.thresholds = settings_.samples;
  if (probability < 1)
    job.thresholds = imaging::binomial_thresholds(settings_.samples, probability, jobs.thresholds.data() + first);
  jobs.thresholds.resize(first + static_cast<std::size_t>(job.thresholds));
}

void CaptureBatch::clear(Errors& errors) {
  errors.jobs.clear();
  errors.values.clear();
  errors.rings.clear();
  errors.hot_pixels.clear();
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

void CaptureBatch::fit(Fitter& fitter, const imaging::BatchItem& item, Kind kind, Jobs& jobs) const {
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
  fitter.tiles.fit(*item.lens, lens_to_world, path, jobs.ops, scene_->emitter.plane());
  const bool fresnel = settings_.transport != imaging::Transport::refract;
  const double highest = fresnel ? path.highest_transmittance : 1.0;
  jobs.image = {static_cast<std::uint32_t>(item.seed),
                static_cast<std::uint32_t>(item.seed >> 32),
                0,
                static_cast<std::int32_t>(jobs.ops.size()),
                static_cast<float>(highest),
                0,
                -1};
  jobs.tiles.clear();
  jobs.thresholds.clear();
  const int samples = imaging::mse_samples(static_cast<double>(scene_->sensor.pixels()));
  const auto width = static_cast<std::uint32_t>(scene_->sensor.width);
  const auto number = [width](int column, int row) {
    return static_cast<std::uint32_t>(row) * width + static_cast<std::uint32_t>(column);
  };
  for (const imaging::Tile& tile : fitter.tiles.tiles()) {
    if (tile.unlit && kind == Kind::capture) continue;
    TileJob job{};
    job.columns = tile.box.columns;
    job.pixels = tile.box.columns * tile.box.rows;
    job.first_number = number(tile.box.column, tile.box.row);
    job.places.frame_width = width;
    if (!tile.unlit) {
      job.start = tile.start;
      job.places = imaging::places_of(tile.box, tile.lit, scene_->sensor.width);
      job.lit_pixels = tile.lit.columns * tile.lit.rows;
      job.whole_disc = tile.whole_disc ? 1 : 0;
      job.lit_column = tile.lit.column - tile.box.column;
      job.lit_row = tile.lit.row - tile.box.row;
      job.scale =
          kind == Kind::capture ? optics::kPi / settings_.samples / imaging::kRouletteSurvival : tile.area / samples;
      if (kind == Kind::capture) add_thresholds(tile, highest, job, jobs);
    }
    jobs.tiles.push_back(job);
  }
}

void CaptureBatch::prepare(const std::vector<imaging::BatchItem>& items, Kind kind,
                           const std::vector<std::uint32_t>& places) {
  if (jobs_.size() < items.size()) jobs_.resize(items.size());
  parallel_->for_each(static_cast<int>(items.size()), [&](int index, unsigned thread) {
    const auto at = static_cast<std::size_t>(index);
    fit(*fitters_[thread], items[at], kind, jobs_[at]);
  });
  tiles_.clear();
  images_.clear();
  ops_.clear();
  thresholds_.clear();
  clear(errors_);
  blurred_images_ = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Jobs& jobs = jobs_[i];
    for (TileJob tile : jobs.tiles) {
      tile.image = static_cast<std::int32_t>(i);
      tile.first_threshold += static_cast<std::int32_t>(thresholds_.size());
      tiles_.push_back(tile);
    }
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
  for (const ImageJob& image : images_) read_out_image(OneThread(), here, errors, image, images.data());
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
  for (std::size_t i = 0; i < sums.size(); ++i) of_images[static_cast<std::size_t>(tiles_[i].image)] += sums[i];
  std::vector<imaging::MseEstimate> all;
  const auto count = static_cast<double>(scene_->sensor.pixels());
  for (const imaging::MseSum& sum : of_images) all.push_back(imaging::estimate_of(sum, count));
  return all;
}

}  // namespace relign::gpu
