#include "trials/stage_motion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"

namespace relign::trials {
namespace {

// Reached poses have rounding errors: a target this little beyond a limit counts as on it.
constexpr double kLimitTolerance = 1e-12;

// In travels. Clamping keeps the arithmetic finite.
constexpr double kMaxPose = 1e6;

std::vector<double> product(const std::vector<double>& matrix, const std::vector<double>& vector) {
  const std::size_t n = vector.size();
  std::vector<double> result(n, 0.0);
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t column = 0; column < n; ++column) result[row] += matrix[row * n + column] * vector[column];
  return result;
}

std::vector<double> inverse(const std::vector<double>& matrix, std::size_t n) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto size = static_cast<Eigen::Index>(n);
  std::vector<double> result(n * n);
  Eigen::Map<RowMajor>(result.data(), size, size) =
      Eigen::Map<const RowMajor>(matrix.data(), size, size).partialPivLu().inverse();
  return result;
}

}  // namespace

StageMotion::StageMotion(const SceneFacts& scene, const Perturbations& perturbations,
                         std::vector<double> commanded_start, Limits limits)
    : StageMotion(scene, perturbations, std::move(commanded_start), limits, scene.machine_time) {}

StageMotion::StageMotion(const SceneFacts& scene, const Perturbations& perturbations,
                         std::vector<double> commanded_start, Limits limits, const MachineTime& machine_time)
    : start_(perturbations.start),
      distortion_(perturbations.distortion),
      commanded_start_(std::move(commanded_start)),
      limits_(limits),
      true_pose_(start_),
      commanded_pose_(commanded_start_),
      reached_pose_(commanded_start_) {
  const std::size_t n = scene.axes.size();
  if (start_.size() != n || distortion_.size() != n * n || commanded_start_.size() != n)
    throw Error(ErrorKind::internal, "the perturbations and the scene have different numbers of axes");
  inverse_distortion_ = inverse(distortion_, n);
  for (const Axis& axis : scene.axes)
    seconds_per_travel_.push_back(axis.travel() /
                                  (axis.unit == "deg" ? machine_time.speed_deg_per_s : machine_time.speed_mm_per_s));
}

std::vector<double> StageMotion::reached_at(const std::vector<double>& true_pose) const {
  std::vector<double> moved(true_pose.size());
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = true_pose[i] - start_[i];
  std::vector<double> reached = product(inverse_distortion_, moved);
  for (std::size_t i = 0; i < reached.size(); ++i) reached[i] += commanded_start_[i];
  return reached;
}

// Soft: every coordinate stops at its own limit while the others continue.
void StageMotion::stop_at_each_limit(Arrival& arrival) const {
  for (std::size_t i = 0; i < arrival.true_pose.size(); ++i) {
    double& value = arrival.true_pose[i];
    if (value < -kLimitTolerance) arrival.limits_low |= std::uint64_t{1} << i;
    if (value > 1 + kLimitTolerance) arrival.limits_high |= std::uint64_t{1} << i;
    value = std::clamp(value, 0.0, 1.0);
  }
  if (arrival.limits_low || arrival.limits_high) arrival.reached_pose = reached_at(arrival.true_pose);
}

// Hard: the whole move stops at the first limit that it would cross. A limit that the move leaves or runs along does
// not stop it.
void StageMotion::stop_at_first_limit(const std::vector<double>& target, Arrival& arrival) const {
  const std::size_t n = target.size();
  std::vector<double> share(n, 1.0);  // of the move until this axis meets a limit
  double made = 1;
  for (std::size_t i = 0; i < n; ++i) {
    if (target[i] < -kLimitTolerance) {
      share[i] = true_pose_[i] / (true_pose_[i] - target[i]);
    } else if (target[i] > 1 + kLimitTolerance) {
      share[i] = (1 - true_pose_[i]) / (target[i] - true_pose_[i]);
    } else {
      continue;
    }
    made = std::min(made, share[i]);
  }
  if (made < 1) {
    for (std::size_t i = 0; i < n; ++i) {
      const bool meets_limit = share[i] <= made + kLimitTolerance && share[i] < 1;
      if (meets_limit && target[i] < 0) arrival.limits_low |= std::uint64_t{1} << i;
      if (meets_limit && target[i] > 1) arrival.limits_high |= std::uint64_t{1} << i;
      arrival.true_pose[i] =
          meets_limit ? (target[i] < 0 ? 0.0 : 1.0) : true_pose_[i] + made * (target[i] - true_pose_[i]);
    }
    for (std::size_t i = 0; i < n; ++i)
      arrival.reached_pose[i] = reached_pose_[i] + made * (arrival.reached_pose[i] - reached_pose_[i]);
  }
  for (double& value : arrival.true_pose) value = std::clamp(value, 0.0, 1.0);
}

StageMotion::Arrival StageMotion::would_reach(const std::vector<double>& commanded) const {
  const std::size_t n = start_.size();
  if (commanded.size() != n) throw Error(ErrorKind::internal, "the pose and the stage have different numbers of axes");
  std::vector<double> from_start(n);
  Arrival arrival;
  arrival.commanded_pose = commanded;
  arrival.reached_pose.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    from_start[i] = std::clamp(commanded[i] - commanded_start_[i], -kMaxPose, kMaxPose);
    arrival.reached_pose[i] = std::clamp(commanded[i], commanded_start_[i] - kMaxPose, commanded_start_[i] + kMaxPose);
  }
  std::vector<double> target = product(distortion_, from_start);
  for (std::size_t i = 0; i < n; ++i) target[i] += start_[i];
  arrival.true_pose = target;

  if (limits_ == Limits::soft)
    stop_at_each_limit(arrival);
  else
    stop_at_first_limit(target, arrival);

  for (std::size_t i = 0; i < n; ++i) {
    arrival.true_pose[i] += 0.0;  // removes negative zeros, so that equal poses have equal bits
    arrival.travel_seconds = std::max(arrival.travel_seconds,
                                      std::fabs(arrival.reached_pose[i] - reached_pose_[i]) * seconds_per_travel_[i]);
  }
  return arrival;
}

StageMotion::Arrival StageMotion::step_to(const std::vector<double>& commanded) {
  Arrival arrival = would_reach(commanded);
  true_pose_ = arrival.true_pose;
  commanded_pose_ = arrival.commanded_pose;
  reached_pose_ = arrival.reached_pose;
  return arrival;
}

// Uses the linear map like every other move, so that the reached pose can be commanded again, and recommended, bit for
// bit.
StageMotion::Arrival StageMotion::move_by(const std::vector<double>& delta) {
  if (delta.size() != reached_pose_.size())
    throw Error(ErrorKind::internal, "the move and the stage have different numbers of axes");
  std::vector<double> commanded = reached_pose_;
  for (std::size_t i = 0; i < delta.size(); ++i) commanded[i] += delta[i];
  return step_to(commanded);
}

}  // namespace relign::trials
