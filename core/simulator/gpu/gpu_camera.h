// Batches of images on a GPU, with the bits of imaging/camera.h.
#pragma once

#include <cstdint>
#include <vector>

#include "gpu/capture_batch.h"
#include "gpu/gpu.h"

namespace relign::gpu {

class GpuCamera {
 public:
  // All must outlive the camera. Throws Error(bad_input) if the scene is not supported (capture_batch.h).
  GpuCamera(Gpu& gpu, const imaging::SceneFile& scene, const imaging::CaptureSettings& settings, Parallel& parallel);

  // Writes the items' pixels.
  void capture(const std::vector<imaging::BatchItem>& items);
  // The items' pixels are not used. Throws Error(bad_input) if the reference is not of the scene.
  std::vector<imaging::MseEstimate> noise_free_mse(const std::vector<imaging::BatchItem>& items,
                                                   const imaging::Reference& reference);

  // The steps of capture(). Images stay on the GPU, one after the other, until the next run.
  void prepare(const std::vector<imaging::BatchItem>& items);  // on the CPU
  void upload();
  void run();  // does not wait
  const float* images_on_gpu() const { return images_.as<const float>(); }
  void download(std::size_t image, float* pixels) const;

 private:
  Batch batch_on_gpu() const;

  Gpu* gpu_;
  CaptureBatch jobs_;
  Buffer tiles_, image_jobs_, ops_, thresholds_, texels_, images_, sums_, first_, second_;
};

}  // namespace relign::gpu
