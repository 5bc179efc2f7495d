// Many instances of one scene, moved and captured in parallel on all cores: the basis of Python's environments and of
// training. Provides moves, frames and ground truth; rewards and observations are defined by the callers.
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
#include "trials/stage_motion.h"
#include "trials/trial.h"

namespace relign::environment {

struct BatchSetup {
  plugin_host::Choice scene;
  plugin_host::Choice level;
  trials::Limits limits = trials::Limits::soft;
  std::uint64_t suite_seed = 1;  // determines an instance together with domain and number, as in a suite
  unsigned slots = 1;
  unsigned threads = 1;
  bool on_gpu = false;  // render on the GPU, where frames stay
  std::filesystem::path cache_folder;
  std::function<void(const std::string&)> on_message;  // a plugin's warnings; any thread
};

// Each slot has a lens, a stage and its last frame. Every function works on the given slots in parallel and returns
// when all are done; results do not depend on the number of threads. A slot given twice in one call is an
// Error(bad_input). Use from one thread at a time.
//
// Frame i of an instance has the seed of step i of a trial: equal moves give the frames of a trial.
// Drift of the stage follows the scene's own machine times.
//
// On a GPU (relign/scene/batch.h) captures and ground truth of a call are one batch, with the bits of the CPU. Frames
// are written to memory of the GPU, which the caller provides. Noise-free images and optima are the CPU's there, too.
class Batch {
 public:
  // Creates one scene object per thread, one for a GPU. Throws Error(bad_input) for a station, and where the scene or
  // this machine cannot use a GPU that was requested; and as plugin_host does.
  explicit Batch(BatchSetup setup);
  ~Batch();
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  const trials::SceneFacts& facts() const;
  unsigned slots() const;
  unsigned threads() const;
  std::size_t frame_pixels() const;             // image_height x image_width
  const std::vector<float>& reference() const;  // O*, image_height x image_width

  // On a GPU, before the first reset: slots() x image_height x image_width floats of its memory, for the last frames.
  void set_frames(float* memory);

  struct Draw {
    unsigned slot = 0;
    SeedDomain domain = SeedDomain::training;
    std::uint64_t number = 0;
  };
  // Draws a new instance for each slot, moves its stage to the start and captures frame 0.
  void reset(const std::vector<Draw>& draws);

  // Moves slots[k] by the commanded move `moves[k * axes ...]`, in fractions of the travel, and captures a frame.
  void move_by(const std::vector<unsigned>& slots, const double* moves);

  // Captures frames at arbitrary poses, as training data: the lens of slots[k] at the true pose true_poses[k * axes
  // ...] in [0, 1], with a frame seed derived from `seeds[k]`. Does not move the stages. On a GPU `pixels` is memory of
  // the GPU.
  void capture_at(const std::vector<unsigned>& slots, const double* true_poses, const std::uint64_t* seeds,
                  float* pixels);

  // The same without noise. Throws Error(bad_input) where the scene has no noise-free images.
  void render_at(const std::vector<unsigned>& slots, const double* true_poses, float* pixels);

  // Images with `samples` rays per pixel, and their derivatives by each axis per whole travel: for each slot (axes + 1)
  // x image_height x image_width values, the image first. Other seeds give independent images. Throws Error(bad_input)
  // where the scene has no derivatives.
  void render_slopes_at(const std::vector<unsigned>& slots, const double* true_poses, const std::uint64_t* seeds,
                        std::uint32_t samples, float* pixels);

  // Where each lens images the scene's fields, and how sharply, without noise (the ability "fields"), at `lp_per_mm`
  // line pairs per millimetre: for each slot and each of facts().fields four values, x_px, y_px, tangential and
  // sagittal MTF. Throws Error(bad_input) where the scene has no such fields.
  void fields_at(const std::vector<unsigned>& slots, const double* true_poses, double lp_per_mm, double* values);

  // State at the last frame of a slot; valid until the slot's next reset.
  struct State {
    trials::Instance instance;
    unsigned step = 0;                   // moves since the reset
    std::vector<double> true_pose;       // fractions of the travel
    std::vector<double> commanded_pose;  // reached pose by the encoders, relative to the true start
    std::uint64_t limits_low = 0;        // of the last move: bit i, axis i met its limit
    std::uint64_t limits_high = 0;
    double measured_error = 0;  // of the last frame against O*
  };
  const State& state(unsigned slot) const;
  // The last frames, slots() x image_height x image_width; the address never changes. On a GPU that of set_frames.
  const float* frames() const;

  // Noise-free MSE at the current poses; the value that a trial records for the same step.
  std::vector<trials::Truth> truths(const std::vector<unsigned>& slots);
  // The value of `truths` at an earlier step of the same instances: the true poses and steps of State then.
  std::vector<trials::Truth> truths_at(const std::vector<unsigned>& slots, const double* true_poses,
                                       const std::vector<unsigned>& steps);
  // The pose at which each lens is best, cached until the slot's next reset. Nothing where the scene does not search
  // it.
  std::vector<std::optional<plugin_host::MountedAssembly::Optimum>> optima(const std::vector<unsigned>& slots);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace relign::environment
