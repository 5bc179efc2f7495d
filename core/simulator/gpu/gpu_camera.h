// Batches of images on a GPU, with the bits of imaging/camera.h; with reflections, with their distribution.
#pragma once

#include <cstdint>
#include <vector>

#include "gpu/capture_batch.h"
#include "gpu/gpu.h"
#include "gpu/region_tables.h"
#include "imaging/certificate.h"

namespace relign::gpu {

class GpuCamera {
 public:
  // All but the errors, which captures get if there are any, must outlive the camera. Throws Error(bad_input) if the
  // scene is not supported (capture_batch.h).
  GpuCamera(Gpu& gpu, const imaging::SceneFile& scene, const imaging::CaptureSettings& settings, Parallel& parallel,
            const imaging::DrawnErrors* errors = nullptr);

  // Of squares and noise-free MSE. Throws Error(bad_input) if it is not of the scene.
  void set_reference(const imaging::Reference& reference);

  // Writes the items' pixels.
  void capture(const std::vector<imaging::BatchItem>& items);
  // Into memory of the GPU, in its primary context: item i into the image of number places[i] there, no two into one.
  // The items' pixels are not used. Returns the RMSE of each against the reference, with the bits of images/score.h,
  // when all images are complete; waits first for what other libraries do on the GPU, since they may use the images.
  std::vector<double> capture(const std::vector<imaging::BatchItem>& items, const std::vector<std::uint32_t>& places,
                              float* images);
  // The items' pixels are not used. Throws Error(bad_input) with transport ghost, which the CPU does.
  std::vector<imaging::MseEstimate> noise_free_mse(const std::vector<imaging::BatchItem>& items);

  // Whether it checks each lens before its first image (imaging/certificate.h); otherwise the caller does.
  bool certifies() const { return jobs_.kernels_fit_tiles(); }

  // The steps of capture(items). Images stay on the GPU, one after the other, until the next run.
  void prepare(const std::vector<imaging::BatchItem>& items);  // on the CPU
  void upload();
  void fit_tiles();  // does not wait
  void run();        // the same
  void download(std::size_t image, float* pixels) const;

 private:
  Batch batch_on_gpu() const;
  void send_checks();
  void upload_fits();
  FitBatch fits_on_gpu() const;
  void certify(const std::vector<imaging::BatchItem>& items);
  void run(float* images);
  void run_ghosts(Batch& batch, float* images);

  Gpu* gpu_;
  CaptureBatch jobs_;
  Buffer tiles_, image_jobs_, ops_, thresholds_, texels_, images_, sums_, first_, second_, mean_;
  Buffer ghost_boxes_, ghost_lenses_, ghost_steps_, ghost_bodies_, ghost_stops_;
  Buffer errors_, error_values_, rings_, hot_pixels_, rows_;
  // For tiles that kernels fit.
  RegionTables tables_;
  Buffer fits_, missing_, corners_, blurry_, visible_;
  std::vector<imaging::CheckedPixel> checked_;  // pixels of each lens's first image
  Buffer windows_, check_pixels_, check_images_, check_counts_;
};

}  // namespace relign::gpu
