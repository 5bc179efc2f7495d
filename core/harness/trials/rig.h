// What moves and looks in one trial: the simulated stage with a mounted lens before it, or a station,
// which owns both. A conversation asks it for moves, captures and, where they can be known, truths.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "trials/protocol.h"
#include "trials/trial.h"

namespace relign::trials {

class Rig {
 public:
  Rig() = default;
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;
  virtual ~Rig() = default;

  struct Arrival {
    std::vector<double> commanded_pose;  // as asked
    std::vector<double> true_pose;       // NaN where nobody knows
    std::uint64_t limits_low = 0;        // bit i: axis i met its lower limit on this move
    std::uint64_t limits_high = 0;
    double machine_seconds = 0;  // of this move, settling included
  };
  // To the start pose. Once, before all else.
  virtual Arrival start() = 0;
  virtual Arrival step_to(const std::vector<double>& commanded) = 0;
  virtual const std::vector<double>& reached_pose() const = 0;  // where relative moves start

  // A picture from where the stage is. Returns machine seconds.
  virtual double capture(unsigned step, float* pixels) = 0;

  // What gluing at the recommendation would give: a move there, and the shift while the glue cures. Nothing is moved.
  // NaN where nobody knows.
  struct VirtualMove {
    std::vector<double> true_pose;
    double machine_seconds = 0;
    std::vector<double> uncured_true_pose = {};  // before the glue cures; empty where it does not shift anything
  };
  virtual VirtualMove would_reach(const std::vector<double>& commanded) const = 0;
  // Where the lens is once the glue has cured at this true pose; the same pose where it shifts nothing.
  virtual std::vector<double> cured(std::vector<double> true_pose) const = 0;

  // Noise-free error at a true pose. NaN where nobody knows.
  virtual Truth truth_at(const std::vector<double>& true_pose, std::uint64_t seed) = 0;
  virtual bool tells_truth() const = 0;
};

// The one that belongs to the setup's scene. `setup` must outlive it.
std::unique_ptr<Rig> make_rig(const TrialSetup& setup, const Rules& rules);

// What the scene says of itself, and that it offers a stage exactly when it says so. Throws
// Error(plugin_failed).
SceneFacts facts_of(plugin_host::Scene& scene, const std::string& scene_id);

}  // namespace relign::trials
