// What scene plugins of a lens in front of a sensor have in common: a scene file becomes a scene of the harness,
// whatever leads the rays through the lens.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <relign/plugin.hpp>
#include <string>
#include <vector>

#include "imaging/camera.h"
#include "imaging/field_mtf.h"
#include "imaging/own_optimum.h"
#include "imaging/reference.h"
#include "imaging/scene_file.h"
#include "optics/block_tracer.h"

namespace relign::lens_scene {

struct Parts {
  imaging::CaptureSettings settings;
  imaging::SceneFile scene;
  std::unique_ptr<optics::BlockTracer> tracer;  // null: the prescription's own spheres
  std::string tracer_hash;                      // of all that the tracer's images depend on besides the scene
};

// Settings and scene, from the parameters "transport", "sampler", "samples", "scene", "ambient_index", "target",
// "rotation_z" and "pixels".
Parts read_parts(const Parameters& given);

class LensScene : public Scene {
 public:
  // library: the plugin's own file, beside its manifest.
  LensScene(const Parameters& given, Parts parts, const std::string& library);

  std::string describe() override;
  relign_image reference() override;
  std::unique_ptr<relign::Assembly> mount(std::string_view offsets_json) override;

 private:
  class Mounted;
  // The scene's camera, used by one assembly at a time: assemblies may have threads of their own.
  struct SharedCamera {
    imaging::Camera camera;
    imaging::OptimumFinder optimum;
    std::mutex mutex;
  };
  float white() const;

  imaging::CaptureSettings settings_;
  imaging::SceneFile scene_;
  std::unique_ptr<optics::BlockTracer> tracer_;
  Parallel parallel_;
  imaging::Reference reference_;
  std::optional<imaging::FieldMtfMeter> mtf_;  // once it was asked for
  SharedCamera shared_;
};

}  // namespace relign::lens_scene
