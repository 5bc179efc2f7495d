// Many lenses of one scene, moved and captured together over all cores: what Python's environments and training
// stand on. Speaks of moves, frames and truths alone; rewards and observations belong to those who use it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/seeds.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"
#include "trials/stage.h"
#include "trials/trial.h"

namespace relign::environment {

struct BatchSetup {
  plugin_host::Choice scene;
  plugin_host::Choice level;
  trials::Limits limits = trials::Limits::soft;
  std::uint64_t suite_seed = 1;  // with domain and number it decides an instance, as in a suite
  unsigned slots = 1;
  unsigned threads = 1;
  std::filesystem::path cache_folder;
  std::function<void(const std::string&)> on_message;  // a plugin's warnings; any thread
};

// Slot k holds a lens on a stage of its own and its last frame. Every function works on all named slots at once and
// returns when all are done; what it gives is the same whatever the number of threads. A slot named twice in one call
// is an Error(bad_input). Use from one thread at a time.
//
// Frame i of an instance has the seed that step i of a trial has: the same moves give a trial's very frames.
class Batch {
 public:
  // Makes the scene once per thread. Throws Error: bad_input for a station, which cannot be drawn and copied, and as
  // plugin_host does.
  explicit Batch(BatchSetup setup);
  ~Batch();
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  const trials::SceneFacts& facts() const;
  unsigned slots() const;
  unsigned threads() const;
  std::size_t frame_pixels() const;             // image_height x image_width
  const std::vector<float>& reference() const;  // O*, image_height x image_width

  struct Draw {
    unsigned slot = 0;
    SeedDomain domain = SeedDomain::training;
    std::uint64_t number = 0;
  };
  // Another lens in each named slot, its stage at the start, frame 0 captured.
  void reset(const std::vector<Draw>& draws);

  // The commanded move `moves[k * axes ...]` of slots[k], in shares of the travel, then a frame.
  void move_by(const std::vector<unsigned>& slots, const double* moves);

  // Frames anywhere, for data to train on: lens of slots[k] at the true pose true_poses[k * axes ...] in [0, 1]. Frame
  // seeds come from `seeds[k]`. The stages stay where they are.
  void capture_at(const std::vector<unsigned>& slots, const double* true_poses, const std::uint64_t* seeds,
                  float* pixels);

  // The same without noise. Throws Error(bad_input) where the scene offers none.
  void render_at(const std::vector<unsigned>& slots, const double* true_poses, float* pixels);

  // Of the last frame of a slot; valid until the slot's next reset.
  struct State {
    trials::Instance instance;
    unsigned step = 0;                   // moves since the reset
    std::vector<double> true_pose;       // shares of the travel
    std::vector<double> commanded_pose;  // reached, as the encoders tell it; counts from the true start
    std::uint64_t limits_low = 0;        // of the last move: bit i, axis i met its limit
    std::uint64_t limits_high = 0;
    double measured_rmse = 0;  // of the last frame against O*
  };
  const State& state(unsigned slot) const;
  // slots() x image_height x image_width, the last frames; the same place for the life of the batch.
  const float* frames() const;

  // Noise-free MSE at the poses where the slots stand; the value that a trial records for the same step.
  std::vector<trials::Truth> truths(const std::vector<unsigned>& slots);
  // The pose at which each lens is best. Kept until the slot's next reset. Nothing where the scene does not look.
  std::vector<std::optional<plugin_host::MountedAssembly::Optimum>> optima(const std::vector<unsigned>& slots);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace relign::environment
