// The backends of Scene: a library's object or a process. They return the plugin's answers unchecked; Scene checks them
// for both.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "plugin_host/objects.h"

namespace relign::plugin_host {

// A mounted lens. Its destructor unmounts it, before its scene is destroyed.
class AssemblyBackend : public Abilities {
 public:
  AssemblyBackend() = default;
  AssemblyBackend(const AssemblyBackend&) = delete;
  AssemblyBackend& operator=(const AssemblyBackend&) = delete;

  virtual void capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels) = 0;
  virtual MountedAssembly::Truth noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed) = 0;
};

// Every function throws Error(plugin_failed) when the plugin reports a failure or sends a malformed message.
class SceneBackend {
 public:
  SceneBackend() = default;
  SceneBackend(const SceneBackend&) = delete;
  SceneBackend& operator=(const SceneBackend&) = delete;
  virtual ~SceneBackend() = default;

  virtual std::string describe() = 0;
  virtual relign_image reference() = 0;
  virtual std::unique_ptr<AssemblyBackend> mount(const std::string& offsets_json) = 0;

  // What errors call the function that judges a pose.
  virtual const char* judge() const { return "noise_free_mse"; }

  virtual bool offers(std::string_view ability) = 0;  // as far as it is known before the call

  struct Batch {
    std::vector<AssemblyBackend*> assemblies;
    const std::vector<double>& true_poses;
    const std::vector<std::uint64_t>& seeds;
  };
  // The functions after open_gpu are called only when it returned an empty text.
  virtual std::string open_gpu() { return "the scene has no GPU simulator"; }
  virtual std::vector<double> capture_batch(const Batch&, const std::vector<std::uint32_t>&, float*) { return {}; }
  virtual std::vector<MountedAssembly::Truth> mse_batch(const Batch&) { return {}; }

  // The three functions after offers_stage are called only when it returns true.
  virtual bool offers_stage() const = 0;
  virtual void begin(std::uint64_t seed) = 0;
  virtual Scene::StageMove move_by(const std::vector<double>& delta) = 0;  // `moved` has as many values as `delta`
  virtual double capture(float* pixels) = 0;                               // machine seconds

  // Throws Error(plugin_failed): the plugin's function `what` returned an invalid result.
  [[noreturn]] virtual void refuse(const char* what, const std::string& message) = 0;
};

std::unique_ptr<SceneBackend> make_library_scene(const Choice& choice, const HostServices& services);
std::unique_ptr<SceneBackend> make_process_scene(const Choice& choice, const HostServices& services);

}  // namespace relign::plugin_host
