// Base of scene plugins with a lens in front of a sensor: turns a scene file into a scene of the harness, with any
// tracer of rays through the lens.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <relign/plugin.hpp>
#include <string>
#include <vector>

#if RELIGN_HAS_GPU
#include "gpu/gpu_camera.h"
#endif
#include "imaging/camera.h"
#include "imaging/capture_errors.h"
#include "imaging/field_mtf.h"
#include "imaging/own_optimum.h"
#include "imaging/reference.h"
#include "imaging/scene_file.h"
#include "optics/block_tracer.h"

namespace relign::lens_scene {

struct Parts {
  imaging::CaptureSettings settings;
  imaging::SceneFile scene;
  std::optional<imaging::ImagingErrors> errors;  // of captures
  std::unique_ptr<optics::BlockTracer> tracer;   // null: the faces of the prescription
  std::string tracer_hash;                       // of everything that the tracer's images depend on besides the scene
};

// Reads out only windows of this size around the scene's fields. Throws Error(bad_input) for a scene whose images need
// more than the light of their own pixels.
void read_windows_only(Parts& parts, int pixels);

// Settings and scene, from the parameters "transport", "sampler", "samples", "scene", "ambient_index", "target",
// "rotation_z" and "pixels".
Parts read_parts(const Parameters& given);

class LensScene : public Scene {
 public:
  // library: file name of the plugin, in the folder of its manifest.
  LensScene(const Parameters& given, Parts parts, const std::string& library);

  std::string describe() override;
  relign_image reference() override;
  std::unique_ptr<relign::Assembly> mount(std::string_view offsets_json) override;
  bool captures_regions() const override { return !shared_.errors && shared_.camera.captures_regions(); }
#if RELIGN_HAS_GPU
  bool captures_batches() const override { return true; }
  std::string open_gpu() override;
  std::vector<double> capture_batch(const std::vector<BatchItem>& items, const std::vector<std::uint32_t>& places,
                                    float* images) override;
  std::vector<relign::Assembly::Truth> mse_batch(const std::vector<BatchItem>& items) override;
#endif

 private:
  class Mounted;
  // The scene's camera, used by one assembly at a time, since assemblies may be used by different threads.
  struct SharedCamera {
    imaging::Camera camera;
    imaging::OptimumFinder optimum;
    std::optional<imaging::CaptureErrors> errors;
    std::mutex mutex;
  };
  // For specifications by field: fewer rays than for the MTF at the end, because it measures at every step.
  struct FieldMeter {
    std::vector<imaging::FieldPoint> points;
    imaging::FieldMtfMeter meter;
  };
#if RELIGN_HAS_GPU
  struct OnGpu {
    explicit OnGpu(LensScene& of)
        : camera(gpu, of.scene_, of.settings_, of.parallel_,
                 of.shared_.errors ? &of.shared_.errors->drawn() : nullptr) {
      camera.set_reference(of.reference_);
    }
    gpu::Gpu gpu;
    gpu::GpuCamera camera;
  };
  std::vector<imaging::BatchItem> on_gpu(const std::vector<BatchItem>& items);
#endif
  float white() const;
  Json machine_time() const;

  imaging::CaptureSettings settings_;
  imaging::SceneFile scene_;
  std::unique_ptr<optics::BlockTracer> tracer_;
  Parallel parallel_;
  imaging::Reference reference_;
  std::optional<imaging::FieldMtfMeter> mtf_;  // made on first use
  std::optional<FieldMeter> field_meter_;      // the same
  SharedCamera shared_;
#if RELIGN_HAS_GPU
  std::unique_ptr<OnGpu> on_gpu_;  // null: not open
#endif
};

}  // namespace relign::lens_scene
