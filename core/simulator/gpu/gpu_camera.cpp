#include "gpu/gpu_camera.h"

#include <cmath>

#include "base/error.h"

namespace relign::gpu {
namespace {

template <class T>
void send(Buffer& buffer, const std::vector<T>& values) {
  buffer.upload(values.data(), values.size() * sizeof(T));
}

}  // namespace

GpuCamera::GpuCamera(Gpu& gpu, const imaging::SceneFile& scene, const imaging::CaptureSettings& settings,
                     Parallel& parallel, const imaging::DrawnErrors* errors)
    : gpu_(&gpu),
      jobs_(scene, settings, parallel, errors),
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
      errors_(gpu),
      error_values_(gpu),
      rings_(gpu),
      hot_pixels_(gpu),
      rows_(gpu) {
  if (scene.emitter.plane().texels_8_bit)
    send(texels_, scene.emitter.texels_8_bit);
  else
    send(texels_, scene.emitter.texels_16_bit);
}

void GpuCamera::prepare(const std::vector<imaging::BatchItem>& items) {
  jobs_.prepare(items, CaptureBatch::Kind::capture);
}

void GpuCamera::upload() {
  send(tiles_, jobs_.tiles());
  send(image_jobs_, jobs_.images());
  send(ops_, jobs_.ops());
  send(thresholds_, jobs_.thresholds());
  send(errors_, jobs_.errors());
  send(error_values_, jobs_.error_values());
  send(rings_, jobs_.rings());
  send(hot_pixels_, jobs_.hot_pixels());
  rows_.reserve(jobs_.blurred_images() * jobs_.scene().sensor.pixels() * sizeof(float));
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
  gpu_->launch(Gpu::Kernel::clear, jobs_.images().size(), arguments);
  gpu_->launch(Gpu::Kernel::capture, jobs_.tiles().size(), arguments);
  if (!jobs_.reads_out()) return;
  ErrorBatch errors = jobs_.error_batch();
  errors.jobs = errors_.as<const ErrorJob>();
  errors.values = error_values_.as<const float>();
  errors.rings = rings_.as<const imaging::Ring>();
  errors.hot_pixels = hot_pixels_.as<const std::uint32_t>();
  errors.rows = rows_.as<float>();
  void* read_out_arguments[] = {&batch, &images, &errors};
  gpu_->launch(Gpu::Kernel::read_out, jobs_.images().size(), read_out_arguments);
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
  run();
  for (std::size_t i = 0; i < items.size(); ++i) download(i, items[i].pixels);
}

std::vector<double> GpuCamera::capture(const std::vector<imaging::BatchItem>& items,
                                       const std::vector<std::uint32_t>& places, float* images) {
  jobs_.prepare(items, CaptureBatch::Kind::capture, places);
  upload();
  gpu_->wait();
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
  std::vector<imaging::MseSum> sums(jobs_.tiles().size());
  sums_.reserve(sums.size() * sizeof sums[0]);
  Batch batch = batch_on_gpu();
  Address address = sums_.address();
  void* arguments[] = {&batch, &address};
  gpu_->launch(Gpu::Kernel::mse, jobs_.tiles().size(), arguments);
  sums_.download(sums.data(), sums.size() * sizeof sums[0]);
  return jobs_.estimates(sums);
}

}  // namespace relign::gpu
