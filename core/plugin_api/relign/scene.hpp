// relign/scene.hpp: the classes that scenes and stations derive from. Comes with relign/plugin.hpp.
#ifndef RELIGN_SCENE_HPP
#define RELIGN_SCENE_HPP

#include <relign/plugin.h>

#include <cstdint>
#include <memory>
#include <relign/abilities.hpp>
#include <relign/basics.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace relign {

// One lens as assembled. See relign_scene_interface for meanings; poses are true poses in 0..1.
class Assembly : public Abilities {
 public:
  virtual void capture(const Pose& true_pose, std::uint64_t frame_seed, float* pixels) = 0;
  struct Truth {
    double mse;
    double standard_error;
  };
  virtual Truth noise_free_mse(const Pose& true_pose, std::uint64_t seed) = 0;
};

class Scene : public SceneAbilities {
 public:
  virtual std::string describe() = 0;
  virtual relign_image reference() = 0;
  virtual std::unique_ptr<Assembly> mount(std::string_view offsets_json) = 0;

  // Optional: batches on a GPU, as relign_scene_batch defines them, for scenes whose captures_batches() is true.
  virtual bool captures_batches() const { return false; }
  struct BatchItem {
    Assembly* assembly;
    Pose true_pose;
    std::uint64_t seed;
  };
  // Returns why this scene or this machine cannot use the GPU; empty: it is open.
  virtual std::string open_gpu() { return "the scene has no GPU simulator"; }
  // Returns the RMSE of each image.
  virtual std::vector<double> capture_batch(const std::vector<BatchItem>& /*items*/,
                                            const std::vector<std::uint32_t>& /*places*/, float* /*images*/) {
    throw std::logic_error("captures_batches() is true, but the scene has no capture_batch()");
  }
  virtual std::vector<Assembly::Truth> mse_batch(const std::vector<BatchItem>& /*items*/) {
    throw std::logic_error("captures_batches() is true, but the scene has no mse_batch()");
  }
};

// A scene that owns its stage: a real machine, whose start, distortion and ground truth are unknown. Its
// describe says "owns_stage": true and "truth": false. See relign_scene_stage for the order of calls.
// One object drives one station; what throws ends the trial, and the host makes a new object.
class Station : public Scene {
 public:
  // Brings the lens to a start pose: the same one for equal seeds, as well as the machine can.
  virtual void begin(std::uint64_t seed) = 0;

  struct Moved {
    Pose moved;  // what the stage moved by its own encoders; shorter than asked for where a limit cut it
    std::uint64_t limits_low = 0;   // bit i: axis i met its lower limit
    std::uint64_t limits_high = 0;  // bit i: axis i met its upper limit
    double machine_seconds = 0;     // measured, settling included
  };
  // One move relative to where the stage is, in shares of the travel.
  virtual Moved move_by(const Pose& delta) = 0;

  // One picture from where the stage is (width x height floats). Returns the machine seconds it took.
  virtual double capture(float* pixels) = 0;

  std::unique_ptr<Assembly> mount(std::string_view) final {
    throw std::logic_error("a station takes its lenses from the production, not from a noise level");
  }
};

}  // namespace relign

#endif  // RELIGN_SCENE_HPP
