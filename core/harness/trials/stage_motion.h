// The motion of the simulated stage: turns commanded moves into true poses, with distortion and limits, and computes
// machine time.
//
// Law (paper): true pose s' = clip(s + D a) for a commanded move a. "soft" clips every coordinate separately; "hard"
// stops the whole move at the first limit it would cross. Encoders and true pose are related by one linear map for the
// whole trial, s = start + D (c - c_start), so that the same commanded pose always means the same true pose. After a
// limit has cut a move, relative moves start at the commanded coordinates of the pose that the stage reached.
#pragma once

#include <cstdint>
#include <vector>

#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::trials {

enum class Limits { soft, hard };

class StageMotion {
 public:
  // commanded_start: coordinates of the start pose (the true start, or zeros for coordinates relative to it).
  StageMotion(const SceneFacts& scene, const Perturbations& perturbations, std::vector<double> commanded_start,
              Limits limits);
  // With machine times other than the scene's own.
  StageMotion(const SceneFacts& scene, const Perturbations& perturbations, std::vector<double> commanded_start,
              Limits limits, const MachineTime& machine_time);

  struct Arrival {
    std::vector<double> true_pose;
    std::vector<double> commanded_pose;  // as requested
    std::vector<double> reached_pose;    // commanded coordinates of the end; as requested unless a limit cut the move
    std::uint64_t limits_low = 0;        // bit i: axis i met its lower limit on this move
    std::uint64_t limits_high = 0;
    double travel_seconds = 0;  // of this move, from reached to reached pose
  };

  const std::vector<double>& true_pose() const { return true_pose_; }
  const std::vector<double>& commanded_pose() const { return commanded_pose_; }  // requested last
  const std::vector<double>& reached_pose() const { return reached_pose_; }      // where relative moves start

  // The end of a move, without moving. Used for recommendations.
  Arrival would_reach(const std::vector<double>& commanded) const;
  Arrival step_to(const std::vector<double>& commanded);  // moves
  Arrival move_by(const std::vector<double>& delta);      // moves, relative to the reached pose

 private:
  void stop_at_each_limit(Arrival& arrival) const;
  void stop_at_first_limit(const std::vector<double>& target, Arrival& arrival) const;
  std::vector<double> reached_at(const std::vector<double>& true_pose) const;

  std::vector<double> start_;
  std::vector<double> distortion_;          // row-major
  std::vector<double> inverse_distortion_;  // row-major
  std::vector<double> seconds_per_travel_;  // per axis: time for a move over the whole travel
  std::vector<double> commanded_start_;
  Limits limits_;
  std::vector<double> true_pose_;
  std::vector<double> commanded_pose_;  // as requested
  std::vector<double> reached_pose_;    // equal to commanded_pose_ unless a limit cut the move
};

}  // namespace relign::trials
