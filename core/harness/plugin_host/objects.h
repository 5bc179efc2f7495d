// Plugins as C++ objects: the host's side of relign/plugin.h, and of the messages to plugins that are processes.
//
// Every call into a plugin passes the guard: floating-point state (MXCSR, rounding) is saved and
// restored, a failure becomes Error(plugin_failed) with the plugin's id and its sentence. After a
// trial, environment_changes() tells what else a plugin left behind.
#pragma once

#include <relign/plugin.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "plugin_host/catalog.h"

namespace relign::plugin_host {

// What the host gives to a plugin's objects besides its parameters.
struct HostServices {
  unsigned threads = 1;
  std::filesystem::path cache_folder;                              // empty: none
  std::function<void(int level, const std::string& message)> log;  // may be empty; any thread
  // Once it is up, a plugin's process is waited for RELIGN_STOP_SECONDS and no longer. May be null; must outlive the
  // object.
  const std::atomic<bool>* stop = nullptr;
};

// A plugin's process broke off its work. `outcome` is how a trial ends by it (records/record.h): "crashed(SIGSEGV)",
// "timeout", "protocol_error".
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
  // Loads the library if need be and creates the object; or starts the plugin's process. Throws Error:
  // plugin_refused when the library cannot be loaded or its ABI or manifest do not fit, or the command
  // cannot be started; plugin_failed when handshake or create failed.
  Algorithm(const Choice& choice, const HostServices& services);
  ~Algorithm();
  Algorithm(const Algorithm&) = delete;
  Algorithm& operator=(const Algorithm&) = delete;

  // Drives one whole trial. Throws Error(plugin_failed) when the plugin reports a failure. An
  // exception thrown by a function of `talk` never crosses the plugin: the plugin is told to stop,
  // and the exception leaves from here. While `talk` works, the host's floating-point state holds.
  void run(const relign_conversation& talk);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

class NoiseLevel {
 public:
  NoiseLevel(const Choice& choice, const HostServices& services);
  ~NoiseLevel();
  NoiseLevel(const NoiseLevel&) = delete;
  NoiseLevel& operator=(const NoiseLevel&) = delete;

  // W as JSON text, unchecked (task reads it).
  std::string draw(std::uint64_t seed, const std::string& scene_description);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

class Scene;

// One mounted lens. Outlives nothing: destroy it before its Scene.
class MountedAssembly {
 public:
  ~MountedAssembly();
  MountedAssembly(MountedAssembly&&) noexcept;
  MountedAssembly& operator=(MountedAssembly&&) = delete;

  void capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels);
  struct Truth {
    double mse;
    double standard_error;
  };
  Truth noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed);
  // False when the scene does not offer it.
  bool render_noise_free(const std::vector<double>& true_pose, float* pixels);
  struct Average {
    double standard_error = 0;  // of a pixel, root mean square over all
    std::uint64_t samples = 0;  // a pixel
  };
  // A noise-free image whose noise is known (relign_scene_average); nothing when the scene does not offer it.
  std::optional<Average> render_average(const std::vector<double>& true_pose, std::uint64_t seed, double error,
                                        std::uint64_t samples, float* pixels);
  struct Optimum {
    std::vector<double> true_pose;
    Truth truth{};
  };
  // The pose at which this lens is best; nothing when the scene does not look for it.
  std::optional<Optimum> own_optimum(std::uint64_t seed, std::size_t axes);
  struct FieldMtf {
    double centre = 0, corner = 0;
  };
  // The lens's geometric MTF (relign_scene_mtf); nothing when the scene does not tell it.
  std::optional<FieldMtf> mtf(const std::vector<double>& true_pose, double lp_per_mm);

 private:
  friend class Scene;
  struct Implementation;
  explicit MountedAssembly(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

// One object per worker; a process of its own where the plugin is one. Used, with its assemblies, by one thread at a
// time when it is a process.
class Scene {
 public:
  Scene(const Choice& choice, const HostServices& services);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  std::string describe();    // JSON text as the plugin wrote it
  relign_image reference();  // valid as long as this
  MountedAssembly mount(const std::string& offsets_json);

  // A scene that owns its stage (RELIGN_SCENE_STAGE); the other three throw Error without one.
  bool offers_stage() const;
  void begin(std::uint64_t seed);
  struct StageMove {
    std::vector<double> moved;  // by the station's own encoders
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

// SHA-256 of a plugin's library (or the files in its command) and manifest, recorded beside trials.
std::string plugin_hash(const Manifest& manifest);

// What of this process plugins must leave alone: working directory, locale, signal handlers,
// floating-point state. Take one before a trial and ask after it.
// Working directory, locale and handlers belong to the whole process: with several workers as
// threads, a sentence may name what another worker's plugin did at the same time.
class EnvironmentWatch {
 public:
  EnvironmentWatch();
  ~EnvironmentWatch();
  EnvironmentWatch(const EnvironmentWatch&) = delete;
  EnvironmentWatch& operator=(const EnvironmentWatch&) = delete;
  // A sentence per thing that changed since construction; what changed is restored.
  std::vector<std::string> changes();

 private:
  struct Snapshot;
  std::unique_ptr<Snapshot> before_;
};

}  // namespace relign::plugin_host
