// The stage of one trial, with the lens and the sensor: simulated, or the hardware of a station. TrialHost asks it for
// moves, captures and, where there is one, ground truth.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "trials/protocol.h"
#include "trials/trial.h"

namespace relign::trials {

class Stage {
 public:
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  virtual ~Stage() = default;

  struct Arrival {
    std::vector<double> commanded_pose;  // as requested
    std::vector<double> true_pose;       // NaN where unknown
    std::uint64_t limits_low = 0;        // bit i: axis i met its lower limit on this move
    std::uint64_t limits_high = 0;
    double machine_seconds = 0;  // of this move, including settling
  };
  // Moves to the start pose. Call it once, before anything else.
  virtual Arrival start() = 0;
  virtual Arrival step_to(const std::vector<double>& commanded) = 0;
  virtual const std::vector<double>& reached_pose() const = 0;  // where relative moves start

  // Captures an image at the current pose, or only its regions, if there are some. Returns machine seconds.
  virtual double capture(unsigned step, const PixelRegions& regions, float* pixels) = 0;
  virtual bool captures_regions() const = 0;  // otherwise `regions` must be empty

  // The result of fixing the lens at a recommended pose: a move there, and the shift while the glue cures. Nothing
  // moves. NaN where unknown.
  struct VirtualMove {
    std::vector<double> true_pose;
    double machine_seconds = 0;
    std::vector<double> uncured_true_pose = {};  // before curing; empty where curing shifts nothing
  };
  virtual VirtualMove would_reach(const std::vector<double>& commanded) const = 0;
  // True pose after curing at this true pose; the same pose where curing shifts nothing.
  virtual std::vector<double> cured(std::vector<double> true_pose) const = 0;

  // Noise-free error at a true pose. NaN where unknown.
  virtual Truth truth_at(const std::vector<double>& true_pose, std::uint64_t seed) = 0;
  virtual bool has_ground_truth() const = 0;
};

// Makes the stage of the setup's scene. `setup` must outlive it.
std::unique_ptr<Stage> make_stage(const TrialSetup& setup, const Rules& rules);

// Reads the scene's description, and checks that it offers a stage exactly when "owns_stage" is true. Throws
// Error(plugin_failed).
SceneFacts facts_of(plugin_host::Scene& scene, const std::string& scene_id);

}  // namespace relign::trials
