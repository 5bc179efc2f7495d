// The jobs of a batch of images (capture_kernel.h): what the CPU prepares before kernels run, on the GPU or in a plain
// loop here.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "gpu/ghost_kernel.h"
#include "gpu/table_slots.h"
#include "imaging/camera.h"
#include "imaging/camera_batch.h"
#include "imaging/drawn_errors.h"
#include "imaging/ghost_image.h"

namespace relign::gpu {

// Why the kernels cannot render a scene, or empty: they do captures at the paper's noise, with electronics and imaging
// errors, and noise-free MSE but of transport ghost, through spheres and conics, at one wavelength, without diffraction
// and windows.
std::string unsupported(const imaging::SceneFile& scene, const imaging::CaptureSettings& settings);

class CaptureBatch {
 public:
  // Who fits the tiles. Kernels can if regions are on a plane (optics/pupil_search.h); else the CPU does.
  enum class Tiles { fitted_here, fitted_by_kernels };
  // scene and parallel must outlive the batch. errors: of captures; copied. Throws Error(bad_input) if unsupported.
  CaptureBatch(const imaging::SceneFile& scene, const imaging::CaptureSettings& settings, Parallel& parallel,
               const imaging::DrawnErrors* errors = nullptr, Tiles tiles = Tiles::fitted_here);
  ~CaptureBatch();

  enum class Kind { capture, noise_free_mse };
  // With all threads; fits the tiles of every image, unless kernels do. Lenses may be shared by several items.
  // places: of captures, counted in images; empty: in their order.
  void prepare(const std::vector<imaging::BatchItem>& items, Kind kind, const std::vector<std::uint32_t>& places = {});

  const std::vector<TileJob>& tiles() const { return tiles_; }  // empty if kernels fit them
  const std::vector<ImageJob>& images() const { return images_; }
  const std::vector<optics::Op>& ops() const { return ops_; }
  const std::vector<std::uint32_t>& thresholds() const { return thresholds_; }
  // Of transport ghost, in place of tiles.
  struct Ghosts {
    std::vector<GhostBoxJob> boxes;
    std::vector<GhostLensJob> lenses;
    std::vector<optics::GhostStep> steps;
    std::vector<optics::GhostBody> bodies;
    std::vector<optics::GhostStop> stops;
  };
  bool has_ghosts() const { return settings_.transport == imaging::Transport::ghost; }
  const Ghosts& ghosts() const { return ghosts_; }
  GhostBatch ghost_batch() const;  // with the jobs in this memory
  bool kernels_fit_tiles() const { return by_kernels_; }
  const std::vector<FitJob>& fits() const { return fits_; }            // without tables
  const std::vector<LensIdentity>& lenses() const { return lenses_; }  // of each image
  const optics::PupilSearch& search() const { return *search_; }       // of the scene's lens
  // Without places in memory.
  FitBatch fit_batch() const;
  std::size_t tile_count() const;
  const std::vector<ErrorJob>& errors() const { return errors_.jobs; }
  const std::vector<float>& error_values() const { return errors_.values; }
  const std::vector<imaging::Ring>& rings() const { return errors_.rings; }
  const std::vector<std::uint32_t>& hot_pixels() const { return errors_.hot_pixels; }
  std::size_t blurred_images() const { return blurred_images_; }  // that ErrorBatch::rows needs
  // Whether captures change after their light is rendered.
  bool reads_out() const { return scene_->sensor.electronics || !errors_.jobs.empty(); }
  // With the jobs in this memory. The reference: of an MSE.
  Batch batch(const imaging::Reference* reference = nullptr) const;
  ErrorBatch error_batch() const;  // without rows
  const imaging::SceneFile& scene() const { return *scene_; }

  // What the kernels do, in this process: images, one after the other; and the MSE of each.
  std::vector<float> capture_here() const;
  std::vector<imaging::MseEstimate> mse_here(const imaging::Reference& reference) const;
  // From the kernel's sums, one for each tile.
  std::vector<imaging::MseEstimate> estimates(const std::vector<imaging::MseSum>& sums) const;

 private:
  struct Fitter;
  struct Errors {
    std::vector<ErrorJob> jobs;
    std::vector<float> values;
    std::vector<imaging::Ring> rings;
    std::vector<std::uint32_t> hot_pixels;
  };
  struct Jobs {  // of one image; indices count from its own first
    std::vector<TileJob> tiles;
    std::vector<optics::Op> ops;
    std::vector<std::uint32_t> thresholds;
    Ghosts ghosts;
    Errors errors;  // of at most one job
    ImageJob image{};
    FitJob fit;
  };
  static void clear(Errors& errors);
  static void clear(Ghosts& ghosts);
  void set_ghosts(imaging::GhostImage& image, const imaging::BatchItem& item,
                  const std::optional<optics::Motion>& into_print, Jobs& jobs) const;
  void add_ghosts(const Ghosts& ghosts);
  static void set_errors(const imaging::DrawnErrors& drawn, Errors& errors);
  void add_errors(const Errors& errors);
  void set_jobs(Fitter& fitter, const imaging::BatchItem& item, Kind kind, Jobs& jobs) const;
  void fit_tiles(Fitter& fitter, const imaging::BatchItem& item, Jobs& jobs) const;

  const imaging::SceneFile* scene_;
  imaging::CaptureSettings settings_;
  Parallel* parallel_;
  std::shared_ptr<const optics::PupilSearch> search_;
  bool by_kernels_ = false;                       // tiles are fitted
  std::vector<std::unique_ptr<Fitter>> fitters_;  // one per thread
  std::vector<Jobs> jobs_;
  std::vector<TileJob> tiles_;
  std::vector<ImageJob> images_;
  std::vector<FitJob> fits_;
  std::vector<LensIdentity> lenses_;
  TileRays rays_{};
  std::vector<optics::Op> ops_;
  std::vector<std::uint32_t> thresholds_;
  Ghosts ghosts_;
  Errors errors_;
  std::size_t blurred_images_ = 0;
};

}  // namespace relign::gpu
