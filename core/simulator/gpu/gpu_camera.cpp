#include "gpu/gpu_camera.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"

namespace relign::gpu {
namespace {

template <class T>
void send(Buffer& buffer, const std::vector<T>& values) {
  buffer.upload(values.data(), values.size() * sizeof(T));
}

std::size_t blocks_of(std::size_t threads) { return (threads + kTileThreads - 1) / kTileThreads; }

}  // namespace

GpuCamera::GpuCamera(Gpu& gpu, const imaging::SceneFile& scene, const imaging::CaptureSettings& settings,
                     Parallel& parallel, const imaging::DrawnErrors* errors)
    : gpu_(&gpu),
      jobs_(scene, settings, parallel, errors, CaptureBatch::Tiles::fitted_by_kernels),
      tiles_(gpu),
      image_jobs_(gpu),
      ops_(gpu),
      thresholds_(gpu),
      texels_(gpu),
      images_(gpu),
      sums_(gpu),
      first_(gpu),
      second_(gpu),
      mean_(gpu),
      ghost_boxes_(gpu),
      ghost_lenses_(gpu),
      ghost_steps_(gpu),
      ghost_bodies_(gpu),
      ghost_stops_(gpu),
      errors_(gpu),
      error_values_(gpu),
      rings_(gpu),
      hot_pixels_(gpu),
      rows_(gpu),
      tables_(gpu, jobs_.fit_batch().places.places()),
      fits_(gpu),
      missing_(gpu),
      corners_(gpu),
      blurry_(gpu),
      visible_(gpu),
      windows_(gpu),
      check_pixels_(gpu),
      check_images_(gpu),
      check_counts_(gpu) {
  if (scene.emitter.plane().texels_8_bit)
    send(texels_, scene.emitter.texels_8_bit);
  else
    send(texels_, scene.emitter.texels_16_bit);
  if (jobs_.kernels_fit_tiles()) send_checks();
}

void GpuCamera::send_checks() {
  const imaging::TileGrid grid = imaging::tile_grid(jobs_.scene().sensor);
  std::vector<imaging::PixelBox> boxes;
  for (int tile = 0; tile < grid.tiles(); ++tile) boxes.push_back(grid.box(tile % grid.across, tile / grid.across));
  checked_ = imaging::pixels_to_check(boxes, imaging::kFirstImageRays, imaging::kFirstImageSeed);
  std::vector<CheckJob> jobs;
  for (const imaging::CheckedPixel& pixel : checked_)
    jobs.push_back({pixel.column, pixel.row, static_cast<std::int32_t>(pixel.tile)});
  send(check_pixels_, jobs);
  const optics::DirectionWindows windows = jobs_.search().windows();
  windows_.upload(windows.samples, optics::DirectionWindows::kHeights * optics::DirectionWindows::kRadii *
                                       sizeof(optics::DirectionWindow));
}

void GpuCamera::prepare(const std::vector<imaging::BatchItem>& items) {
  jobs_.prepare(items, CaptureBatch::Kind::capture);
}

void GpuCamera::upload() {
  send(image_jobs_, jobs_.images());
  send(ops_, jobs_.ops());
  if (jobs_.kernels_fit_tiles()) {
    upload_fits();
  } else {
    send(tiles_, jobs_.tiles());
    send(thresholds_, jobs_.thresholds());
  }
  const CaptureBatch::Ghosts& ghosts = jobs_.ghosts();
  send(ghost_boxes_, ghosts.boxes);
  send(ghost_lenses_, ghosts.lenses);
  send(ghost_steps_, ghosts.steps);
  send(ghost_bodies_, ghosts.bodies);
  send(ghost_stops_, ghosts.stops);
  send(errors_, jobs_.errors());
  send(error_values_, jobs_.error_values());
  send(rings_, jobs_.rings());
  send(hot_pixels_, jobs_.hot_pixels());
  rows_.reserve(jobs_.blurred_images() * jobs_.scene().sensor.pixels() * sizeof(float));
}

void GpuCamera::upload_fits() {
  const FitBatch batch = jobs_.fit_batch();
  std::vector<FitJob> fits = jobs_.fits();
  tables_.assign(jobs_.lenses(), fits);
  send(fits_, fits);
  const std::size_t images = fits.size(), corners = images * static_cast<std::size_t>(batch.grid.corners());
  const auto places = static_cast<std::size_t>(batch.places.places());
  const std::size_t most_missing = std::min(images * places, 8 * corners);
  missing_.reserve((1 + 2 * most_missing) * sizeof(std::int32_t));
  corners_.reserve(corners * sizeof(imaging::TileCorner));
  blurry_.reserve(images * sizeof(std::int32_t));
  const std::size_t tiles = jobs_.tile_count();
  visible_.reserve(tiles * sizeof(imaging::Visibility));
  tiles_.reserve(tiles * sizeof(TileJob));
  if (batch.rays.captures)
    thresholds_.reserve(tiles * sizeof(std::uint32_t) * static_cast<std::size_t>(batch.rays.samples));
}

FitBatch GpuCamera::fits_on_gpu() const {
  FitBatch batch = jobs_.fit_batch();
  batch.jobs = fits_.as<const FitJob>();
  batch.images = image_jobs_.as<const ImageJob>();
  batch.ops = ops_.as<const optics::Op>();
  batch.missing = missing_.as<std::int32_t>();
  batch.corners = corners_.as<imaging::TileCorner>();
  batch.blurry = blurry_.as<std::int32_t>();
  batch.visible = visible_.as<imaging::Visibility>();
  batch.tiles = tiles_.as<TileJob>();
  batch.thresholds = thresholds_.as<std::uint32_t>();
  return batch;
}

void GpuCamera::fit_tiles() {
  if (!jobs_.kernels_fit_tiles()) return;
  FitBatch batch = fits_on_gpu();
  constexpr std::size_t kFillingBlocks = 2048;  // enough for any GPU; each finds many regions if there are more
  const std::int32_t none = 0;
  missing_.upload(&none, sizeof none);
  const std::size_t corners = jobs_.images().size() * static_cast<std::size_t>(batch.grid.corners());
  void* arguments[] = {&batch};
  try {
    gpu_->launch(Gpu::Kernel::request, blocks_of(corners), arguments);
    gpu_->launch(Gpu::Kernel::fill, kFillingBlocks, arguments);
  } catch (...) {
    tables_.forget();  // requested regions may not be found
    throw;
  }
  gpu_->launch(Gpu::Kernel::corners, blocks_of(corners), arguments);
  gpu_->launch(Gpu::Kernel::probes, blocks_of(corners * imaging::kProbes), arguments);
  gpu_->launch(Gpu::Kernel::blur, blocks_of(corners), arguments);
  gpu_->launch(Gpu::Kernel::see, blocks_of(jobs_.tile_count()), arguments);
  gpu_->launch(Gpu::Kernel::tiles, blocks_of(jobs_.tile_count()), arguments);
}

// After fit_tiles().
void GpuCamera::certify(const std::vector<imaging::BatchItem>& items) {
  if (!certifies()) return;
  std::vector<std::int32_t> images;
  std::set<const imaging::MountedLens*> lenses;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (!items[i].lens->is_certified() && lenses.insert(items[i].lens).second)
      images.push_back(static_cast<std::int32_t>(i));
  if (images.empty()) return;
  send(check_images_, images);
  std::vector<std::int32_t> counts(2 * images.size() * checked_.size());
  send(check_counts_, counts);
  FitBatch batch = fits_on_gpu();
  CheckBatch checks{check_images_.as<const std::int32_t>(),
                    check_pixels_.as<const CheckJob>(),
                    static_cast<std::int32_t>(images.size()),
                    static_cast<std::int32_t>(checked_.size()),
                    imaging::kFirstImageRays.rays,
                    static_cast<std::uint32_t>(imaging::kFirstImageSeed),
                    static_cast<std::uint32_t>(imaging::kFirstImageSeed >> 32),
                    jobs_.search().windows(),
                    check_counts_.as<std::int32_t>()};
  checks.windows.samples = windows_.as<const optics::DirectionWindow>();
  void* arguments[] = {&batch, &checks};
  gpu_->launch(Gpu::Kernel::check, blocks_of(counts.size() / 2 * static_cast<std::size_t>(checks.rays)), arguments);
  check_counts_.download(counts.data(), counts.size() * sizeof counts[0]);
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (std::size_t k = 0; k < checked_.size(); ++k) {
      checked_[k].arrived = counts[2 * (i * checked_.size() + k)];
      checked_[k].missing = counts[2 * (i * checked_.size() + k) + 1];
    }
    imaging::expect_all_light(jobs_.scene(), checked_);
    items[static_cast<std::size_t>(images[i])].lens->set_certified();
  }
}

Batch GpuCamera::batch_on_gpu() const {
  Batch batch = jobs_.batch();
  batch.tiles = tiles_.as<const TileJob>();
  batch.images = image_jobs_.as<const ImageJob>();
  batch.ops = ops_.as<const optics::Op>();
  batch.thresholds = thresholds_.as<const std::uint32_t>();
  if (batch.emitter.texels_8_bit)
    batch.emitter.texels_8_bit = texels_.as<const std::uint16_t>();
  else
    batch.emitter.texels_16_bit = texels_.as<const std::uint32_t>();
  batch.reference_first = first_.as<const float>();
  batch.reference_second = second_.as<const float>();
  batch.reference_mean = mean_.as<const float>();
  return batch;
}

void GpuCamera::run(float* images) {
  Batch batch = batch_on_gpu();
  void* arguments[] = {&batch, &images};
  if (jobs_.has_ghosts()) {
    run_ghosts(batch, images);
  } else {
    gpu_->launch(Gpu::Kernel::clear, jobs_.images().size(), arguments);
    gpu_->launch(Gpu::Kernel::capture, jobs_.tile_count(), arguments);
  }
  if (!jobs_.reads_out()) return;
  ErrorBatch errors = jobs_.error_batch();
  errors.jobs = errors_.as<const ErrorJob>();
  errors.values = error_values_.as<const float>();
  errors.rings = rings_.as<const imaging::Ring>();
  errors.hot_pixels = hot_pixels_.as<const std::uint32_t>();
  errors.rows = rows_.as<float>();
  std::int64_t pixels = static_cast<std::int64_t>(jobs_.images().size() * jobs_.scene().sensor.pixels());
  void* read_out_arguments[] = {&batch, &images, &errors, &pixels};
  if (errors.electronics.present)
    gpu_->launch(Gpu::Kernel::electronics, blocks_of(static_cast<std::size_t>(pixels)), read_out_arguments);
  if (jobs_.errors().empty()) return;
  gpu_->launch(Gpu::Kernel::read_out, jobs_.images().size(), read_out_arguments);
}

void GpuCamera::run_ghosts(Batch& batch, float* images) {
  GhostBatch ghosts = jobs_.ghost_batch();
  ghosts.boxes = ghost_boxes_.as<const GhostBoxJob>();
  ghosts.lenses = ghost_lenses_.as<const GhostLensJob>();
  ghosts.steps = ghost_steps_.as<const optics::GhostStep>();
  ghosts.bodies = ghost_bodies_.as<const optics::GhostBody>();
  ghosts.stops = ghost_stops_.as<const optics::GhostStop>();
  void* arguments[] = {&batch, &images, &ghosts};
  gpu_->launch(Gpu::Kernel::ghosts, jobs_.ghosts().boxes.size() * static_cast<std::size_t>(ghosts.blocks_of_box),
               arguments);
}

void GpuCamera::run() {
  images_.reserve(jobs_.images().size() * jobs_.scene().sensor.pixels() * sizeof(float));
  run(images_.as<float>());
}

void GpuCamera::download(std::size_t image, float* pixels) const {
  const std::size_t bytes = jobs_.scene().sensor.pixels() * sizeof(float);
  images_.download(pixels, bytes, image * bytes);
}

void GpuCamera::capture(const std::vector<imaging::BatchItem>& items) {
  prepare(items);
  upload();
  fit_tiles();
  certify(items);
  run();
  for (std::size_t i = 0; i < items.size(); ++i) download(i, items[i].pixels);
}

std::vector<double> GpuCamera::capture(const std::vector<imaging::BatchItem>& items,
                                       const std::vector<std::uint32_t>& places, float* images) {
  jobs_.prepare(items, CaptureBatch::Kind::capture, places);
  upload();
  gpu_->wait();
  fit_tiles();
  certify(items);
  run(images);
  std::vector<double> rmse(items.size());
  sums_.reserve(rmse.size() * sizeof rmse[0]);
  Batch batch = batch_on_gpu();
  Address sums = sums_.address();
  void* arguments[] = {&batch, &images, &sums};
  gpu_->launch(Gpu::Kernel::squares, rmse.size(), arguments);
  sums_.download(rmse.data(), rmse.size() * sizeof rmse[0]);
  for (double& value : rmse) value = std::sqrt(value / static_cast<double>(jobs_.scene().sensor.pixels()));
  return rmse;
}

void GpuCamera::set_reference(const imaging::Reference& reference) {
  const std::size_t pixels = jobs_.scene().sensor.pixels();
  if (reference.first.size() != pixels || reference.second.size() != pixels || reference.mean.size() != pixels)
    throw Error(ErrorKind::bad_input, "the reference has " + std::to_string(reference.first.size()) +
                                          " pixels, the scene's sensor " + std::to_string(pixels));
  send(first_, reference.first);
  send(second_, reference.second);
  send(mean_, reference.mean);
}

std::vector<imaging::MseEstimate> GpuCamera::noise_free_mse(const std::vector<imaging::BatchItem>& items) {
  jobs_.prepare(items, CaptureBatch::Kind::noise_free_mse);
  upload();
  std::vector<imaging::MseSum> sums(jobs_.tile_count());
  sums_.reserve(sums.size() * sizeof sums[0]);
  fit_tiles();
  certify(items);
  Batch batch = batch_on_gpu();
  Address address = sums_.address();
  void* arguments[] = {&batch, &address};
  gpu_->launch(Gpu::Kernel::mse, jobs_.tile_count(), arguments);
  sums_.download(sums.data(), sums.size() * sizeof sums[0]);
  return jobs_.estimates(sums);
}

}  // namespace relign::gpu
