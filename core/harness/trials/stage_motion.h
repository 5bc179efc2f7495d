// The motion of the simulated stage: turns commanded moves into true poses, with distortion, errors and limits, and
// computes machine time.
//
// Law (paper): true pose s' = clip(s + D a) for a commanded move a. "soft" clips every coordinate separately; "hard"
// stops the whole move at the first limit it would cross. One linear map relates commanded and true poses for the whole
// trial, s = start + D (c - c_start). After a limit has cut a move, relative moves start at the commanded coordinates
// of the pose that the stage reached.
//
// With errors of the stage (Perturbations::stage) the pose depends on the moves before:
//   1. Encoder: c - c_start is rounded to multiples of its step, u.
//   2. Backlash of width b, per axis: the carriage, at the start in the middle of the play, follows the drive as a play
//      operator, p' = clamp(p, u - b / 2, u + b / 2) (Visintin, Differential Models of Hysteresis, 1994, chapter III).
//   3. Distortion: s = start + D p, then the limits.
//   4. Repeatability: one normal deviate per axis and move; an axis whose carriage does not move keeps its error.
//   5. Drift: drift (1 - exp(-t / tau)) at machine time t. The sum is clamped to the travel.
// Limits act before 4 and 5, so that noise neither blocks a stage at a limit nor sets a limit's flag.
// Errors are pure functions of instance, move number and machine time, so that trials can be replayed.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::trials {

enum class Limits { soft, hard };

class StageMotion {
 public:
  // commanded_start: coordinates of the start pose (the true start, or zeros for coordinates relative to it).
  StageMotion(const SceneFacts& scene, const Instance& instance, std::vector<double> commanded_start, Limits limits);
  // With machine times other than the scene's own.
  StageMotion(const SceneFacts& scene, const Instance& instance, std::vector<double> commanded_start, Limits limits,
              const MachineTime& machine_time);

  struct Arrival {
    std::vector<double> true_pose;
    std::vector<double> commanded_pose;  // as requested
    std::vector<double> reached_pose;    // commanded coordinates of the end; as requested unless a limit cut the move
    std::uint64_t limits_low = 0;        // bit i: axis i met its lower limit on this move
    std::uint64_t limits_high = 0;
    double travel_seconds = 0;                     // of this move, from reached to reached pose
    std::vector<double> driven_pose = {};          // true pose without the errors of repeatability and drift
    std::vector<double> carriage = {};             // behind the play, from the start; only with errors of the stage
    std::vector<double> repeatability_error = {};  // of the last move of each axis; only with errors of the stage
  };

  const std::vector<double>& true_pose() const { return at_.true_pose; }
  const std::vector<double>& commanded_pose() const { return at_.commanded_pose; }  // requested last
  const std::vector<double>& reached_pose() const { return at_.reached_pose; }      // where relative moves start

  // The end of the next move, without moving: with the errors that this move would have. Used for recommendations. With
  // errors of the stage, a move to the commanded pose is none and ends at the present true pose.
  Arrival would_reach(const std::vector<double>& commanded) const;
  Arrival step_to(const std::vector<double>& commanded);  // moves and settles
  Arrival move_by(const std::vector<double>& delta);      // moves, relative to the reached pose

  // Machine time passes without a move, as while an image is taken.
  void wait(double seconds) { machine_seconds_ += seconds; }

 private:
  Arrival arrive(const std::vector<double>& commanded) const;
  Arrival drive(const std::vector<double>& commanded) const;
  std::vector<double> carriage_at(const std::vector<double>& drive) const;
  void add_errors(Arrival& arrival) const;
  void stop_at_each_limit(const std::vector<double>& drive, Arrival& arrival) const;
  void stop_at_first_limit(const std::vector<double>& target, Arrival& arrival) const;
  std::vector<double> reached_at(const std::vector<double>& driven_pose) const;

  std::vector<double> start_;
  std::vector<double> distortion_;          // row-major
  std::vector<double> inverse_distortion_;  // row-major
  std::vector<double> seconds_per_travel_;  // per axis: time for a move over the whole travel
  std::vector<double> commanded_start_;
  Limits limits_;
  std::optional<StageErrors> errors_;
  std::uint64_t seed_;  // of the instance
  double settle_seconds_;
  Arrival at_;  // of the last move
  std::uint32_t moves_ = 0;
  double machine_seconds_ = 0;
};

}  // namespace relign::trials
