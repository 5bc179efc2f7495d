// Plugins as C++ objects: the host's side of relign/plugin.h, and of the messages to plugins that are processes.
//
// Every call into a plugin is guarded: the floating-point state (MXCSR, rounding) is saved and restored, and a failure
// becomes Error(plugin_failed) with the plugin's id and message. EnvironmentWatch finds other side effects of a plugin.
#pragma once

#include <relign/plugin.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <relign/abilities.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/pixel_region.h"
#include "plugin_host/catalog.h"
#include "plugin_host/process_session.h"

namespace relign::plugin_host {

// The host's services for a plugin's objects.
struct HostServices {
  unsigned threads = 1;
  std::filesystem::path cache_folder;                              // empty: none
  std::function<void(int level, const std::string& message)> log;  // may be empty; any thread
  // Once it is true, the host waits for a plugin's process at most RELIGN_STOP_SECONDS. May be null; must outlive the
  // object.
  const std::atomic<bool>* stop = nullptr;
  // Algorithms run in it, each in a process of its own, libraries too; null: none.
  std::shared_ptr<const Sandbox> sandbox = nullptr;
  bool saves = false;  // pretraining: in a sandbox, too, the plugin may write into the memory that it shares
};

// A plugin's process ended, hung or sent a malformed message. `outcome` is the end of the trial (records/record.h):
// "crashed(SIGSEGV)", "timeout", "protocol_error".
class PluginEnded : public Error {
 public:
  PluginEnded(const std::string& message, std::string outcome)
      : Error(ErrorKind::plugin_failed, message), outcome_(std::move(outcome)) {}
  const std::string& outcome() const { return outcome_; }

 private:
  std::string outcome_;
};

class Algorithm {
 public:
  // Loads the library if needed and creates the object; or starts the plugin's process. Throws Error:
  // plugin_rejected when the library cannot be loaded, its ABI or manifest does not match, or the command
  // cannot be started; plugin_failed when the handshake or create fails.
  Algorithm(const Choice& choice, const HostServices& services);
  ~Algorithm();
  Algorithm(const Algorithm&) = delete;
  Algorithm& operator=(const Algorithm&) = delete;

  // Runs one whole trial. Throws Error(plugin_failed) when the plugin reports a failure. An exception
  // from a function of `trial` does not pass through the plugin: the plugin gets RELIGN_STOP, and the
  // exception is rethrown here. Functions of `trial` run with the host's floating-point state.
  void run(const relign_trial& trial);

 private:
  struct Implementation;
  OrphanWatch orphans_;  // first: what the plugin left behind ends after the plugin
  std::unique_ptr<Implementation> implementation_;
};

class NoiseLevel {
 public:
  NoiseLevel(const Choice& choice, const HostServices& services);
  ~NoiseLevel();
  NoiseLevel(const NoiseLevel&) = delete;
  NoiseLevel& operator=(const NoiseLevel&) = delete;

  // W as JSON text, unchecked (trials/instance.h reads it).
  std::string draw(std::uint64_t seed, const std::string& scene_description);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

class Scene;

// As capture_regions takes them.
inline std::vector<Region> regions_of(const PixelRegions& regions) {
  std::vector<Region> list;
  for (const PixelRegion& region : regions) list.push_back({region.column, region.row, region.columns, region.rows});
  return list;
}

// One mounted lens, with its abilities (core/plugin_api/scene.toml): false, empty or nothing when the scene does not
// offer one. Keeps its scene's object alive. Throws Error(plugin_failed) when the plugin reports a failure or an
// invalid value.
class MountedAssembly final : public Abilities {
 public:
  ~MountedAssembly() override;
  MountedAssembly(MountedAssembly&&) noexcept;
  MountedAssembly& operator=(MountedAssembly&&) = delete;

  void capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels);
  bool captures_regions() const;  // its scene does
  struct Truth {
    double mse;
    double standard_error;
  };
  Truth noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed);
#include "ability_overrides.inc"

 private:
  friend class Scene;
  struct Implementation;
  explicit MountedAssembly(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

// One object per worker, with a process of its own if the plugin runs as a process. Such a scene and its assemblies
// must be used by one thread at a time.
class Scene {
 public:
  Scene(const Choice& choice, const HostServices& services);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  std::string describe();    // JSON text as the plugin wrote it
  relign_image reference();  // valid as long as this object
  MountedAssembly mount(const std::string& offsets_json);

  // Batches on a GPU (relign_scene_batch). Why the scene or this machine cannot; empty: the GPU is open, and the other
  // two functions can be used.
  std::string open_gpu();
  struct Batch {  // the same number of each; assemblies of this scene
    std::vector<MountedAssembly*> assemblies;
    std::vector<double> true_poses;  // one after the other
    std::vector<std::uint64_t> seeds;
  };
  // Element i into image places[i] of `images`, memory of the GPU. Returns the RMSE of each against the reference.
  std::vector<double> capture_batch(const Batch& batch, const std::vector<std::uint32_t>& places, float* images);
  std::vector<MountedAssembly::Truth> mse_batch(const Batch& batch);

  // Whether the scene owns its stage (RELIGN_SCENE_STAGE). If not, the three functions below throw Error.
  bool offers_stage() const;
  void begin(std::uint64_t seed);
  struct StageMove {
    std::vector<double> moved;  // by the station's encoders
    std::uint64_t limits_low = 0;
    std::uint64_t limits_high = 0;
    double machine_seconds = 0;
  };
  StageMove move_by(const std::vector<double>& delta);
  double capture(float* pixels);  // machine seconds

 private:
  friend class MountedAssembly;
  struct Implementation;
  std::shared_ptr<Implementation> implementation_;
};

// SHA-256 of a plugin's library (or the files in its command) and manifest, recorded with trials.
std::string plugin_hash(const Manifest& manifest);

// Watches the process state that plugins must not change: working directory, locale, signal handlers, floating-point
// state. Construct it before a trial and call changes() afterwards.
// Working directory, locale and handlers belong to the whole process: with several workers as
// threads, a message may name a change by another worker's plugin.
class EnvironmentWatch {
 public:
  EnvironmentWatch();
  ~EnvironmentWatch();
  EnvironmentWatch(const EnvironmentWatch&) = delete;
  EnvironmentWatch& operator=(const EnvironmentWatch&) = delete;
  // Restores what changed since construction, and returns a message for each change.
  std::vector<std::string> changes();

 private:
  struct Snapshot;
  std::unique_ptr<Snapshot> before_;
};

}  // namespace relign::plugin_host
