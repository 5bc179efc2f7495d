#include "trials/stage_motion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <relign/portable_math.hpp>
#include <relign/random.hpp>
#include <utility>

#include "base/error.h"
#include "base/seeds.h"

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

// Half away from zero. A step too small for the resolution of `value` rounds nothing.
double rounded(double value, double step) {
  const double steps = value / step;
  return step > 0 && std::fabs(steps) < 0x1p52 ? std::round(steps) * step : value;
}

}  // namespace

StageMotion::StageMotion(const SceneFacts& scene, const Instance& instance, std::vector<double> commanded_start,
                         Limits limits)
    : StageMotion(scene, instance, std::move(commanded_start), limits, scene.machine_time) {}

StageMotion::StageMotion(const SceneFacts& scene, const Instance& instance, std::vector<double> commanded_start,
                         Limits limits, const MachineTime& machine_time)
    : start_(instance.perturbations.start),
      distortion_(instance.perturbations.distortion),
      commanded_start_(std::move(commanded_start)),
      limits_(limits),
      errors_(instance.perturbations.stage),
      seed_(instance.seed),
      settle_seconds_(machine_time.settle_ms / 1000) {
  const std::size_t n = scene.axes.size();
  const auto fits = [n](const std::vector<double>& values) { return values.size() == n; };
  if (!fits(start_) || distortion_.size() != n * n || !fits(commanded_start_) ||
      (errors_ && !(fits(errors_->backlash) && fits(errors_->repeatability) && fits(errors_->encoder_step) &&
                    fits(errors_->drift))))
    throw Error(ErrorKind::internal, "the perturbations and the scene have different numbers of axes");
  inverse_distortion_ = inverse(distortion_, n);
  for (const Axis& axis : scene.axes)
    seconds_per_travel_.push_back(axis.travel() / (axis.speed_per_s > 0 ? axis.speed_per_s
                                                   : axis.unit == "deg" ? machine_time.speed_deg_per_s
                                                                        : machine_time.speed_mm_per_s));
  at_.true_pose = at_.driven_pose = start_;
  at_.commanded_pose = at_.reached_pose = commanded_start_;
  if (errors_) at_.carriage = at_.repeatability_error = std::vector<double>(n, 0.0);
}

std::vector<double> StageMotion::reached_at(const std::vector<double>& driven_pose) const {
  std::vector<double> moved(driven_pose.size());
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = driven_pose[i] - start_[i];
  std::vector<double> reached = product(inverse_distortion_, moved);
  for (std::size_t i = 0; i < reached.size(); ++i) reached[i] += commanded_start_[i];
  return reached;
}

// Soft: every coordinate stops at its own limit while the others continue.
void StageMotion::stop_at_each_limit(const std::vector<double>& drive, Arrival& arrival) const {
  for (std::size_t i = 0; i < arrival.driven_pose.size(); ++i) {
    double& value = arrival.driven_pose[i];
    if (value < -kLimitTolerance) arrival.limits_low |= std::uint64_t{1} << i;
    if (value > 1 + kLimitTolerance) arrival.limits_high |= std::uint64_t{1} << i;
    value = std::clamp(value, 0.0, 1.0);
  }
  if (!arrival.limits_low && !arrival.limits_high) return;
  arrival.reached_pose = reached_at(arrival.driven_pose);
  for (std::size_t i = 0; i < arrival.carriage.size(); ++i) {  // the drive stops as far ahead of the carriage
    const double ahead = drive[i] - arrival.carriage[i];
    arrival.carriage[i] = arrival.reached_pose[i] - commanded_start_[i];
    arrival.reached_pose[i] += ahead;
  }
}

// Hard: the whole move stops at the first limit that it would cross. A limit that the move leaves or runs along does
// not stop it.
void StageMotion::stop_at_first_limit(const std::vector<double>& target, Arrival& arrival) const {
  const std::size_t n = target.size();
  const std::vector<double>& from = at_.driven_pose;
  std::vector<double> share(n, 1.0);  // of the move until this axis meets a limit
  double made = 1;
  for (std::size_t i = 0; i < n; ++i) {
    if (target[i] < -kLimitTolerance) {
      share[i] = from[i] / (from[i] - target[i]);
    } else if (target[i] > 1 + kLimitTolerance) {
      share[i] = (1 - from[i]) / (target[i] - from[i]);
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
      arrival.driven_pose[i] = meets_limit ? (target[i] < 0 ? 0.0 : 1.0) : from[i] + made * (target[i] - from[i]);
    }
    for (std::size_t i = 0; i < arrival.carriage.size(); ++i)
      arrival.carriage[i] = at_.carriage[i] + made * (arrival.carriage[i] - at_.carriage[i]);
    for (std::size_t i = 0; i < n; ++i)
      arrival.reached_pose[i] = at_.reached_pose[i] + made * (arrival.reached_pose[i] - at_.reached_pose[i]);
  }
  for (double& value : arrival.driven_pose) value = std::clamp(value, 0.0, 1.0);
}

std::vector<double> StageMotion::carriage_at(const std::vector<double>& drive) const {
  std::vector<double> carriage(drive.size());
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const double half_play = errors_->backlash[i] / 2;
    carriage[i] = std::clamp(at_.carriage[i], drive[i] - half_play, drive[i] + half_play);
  }
  return carriage;
}

// To the driven pose.
StageMotion::Arrival StageMotion::drive(const std::vector<double>& commanded) const {
  const std::size_t n = start_.size();
  std::vector<double> from_start(n);
  Arrival arrival;
  arrival.commanded_pose = commanded;
  arrival.reached_pose.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    from_start[i] = std::clamp(commanded[i] - commanded_start_[i], -kMaxPose, kMaxPose);
    if (errors_) from_start[i] = rounded(from_start[i], errors_->encoder_step[i]);
    arrival.reached_pose[i] = std::clamp(commanded[i], commanded_start_[i] - kMaxPose, commanded_start_[i] + kMaxPose);
  }
  if (errors_) arrival.carriage = carriage_at(from_start);
  std::vector<double> target = product(distortion_, errors_ ? arrival.carriage : from_start);
  for (std::size_t i = 0; i < n; ++i) target[i] += start_[i];
  arrival.driven_pose = target;

  if (limits_ == Limits::soft)
    stop_at_each_limit(from_start, arrival);
  else
    stop_at_first_limit(target, arrival);

  for (std::size_t i = 0; i < n; ++i) {
    arrival.driven_pose[i] += 0.0;  // removes negative zeros, so that equal poses have equal bits
    arrival.travel_seconds = std::max(
        arrival.travel_seconds, std::fabs(arrival.reached_pose[i] - at_.reached_pose[i]) * seconds_per_travel_[i]);
  }
  return arrival;
}

void StageMotion::add_errors(Arrival& arrival) const {
  Random deviates(frame_seed(seed_, moves_ + 1, FrameStream::stage_errors));
  const double seconds = machine_seconds_ + arrival.travel_seconds + settle_seconds_;
  const double drifted = 1 - portable_exp(-seconds / errors_->drift_seconds);
  arrival.repeatability_error = at_.repeatability_error;
  for (std::size_t i = 0; i < arrival.true_pose.size(); ++i) {
    const double error = errors_->repeatability[i] * deviates.normal();  // drawn for axes that rest, too
    if (arrival.carriage[i] != at_.carriage[i]) arrival.repeatability_error[i] = error;
    arrival.true_pose[i] =
        std::clamp(arrival.driven_pose[i] + arrival.repeatability_error[i] + errors_->drift[i] * drifted, 0.0, 1.0);
  }
}

StageMotion::Arrival StageMotion::arrive(const std::vector<double>& commanded) const {
  if (commanded.size() != start_.size())
    throw Error(ErrorKind::internal, "the pose and the stage have different numbers of axes");
  // Repeated, a command that a limit cut must move nothing, although the play would let the carriage move.
  const bool repeated = errors_ && commanded == at_.commanded_pose;
  Arrival arrival = repeated ? at_ : drive(commanded);
  if (repeated) arrival.travel_seconds = 0;
  arrival.true_pose = arrival.driven_pose;
  if (errors_) add_errors(arrival);
  return arrival;
}

StageMotion::Arrival StageMotion::would_reach(const std::vector<double>& commanded) const {
  Arrival arrival = arrive(commanded);
  if (errors_ && commanded == at_.commanded_pose) arrival.true_pose = at_.true_pose;
  return arrival;
}

StageMotion::Arrival StageMotion::step_to(const std::vector<double>& commanded) {
  at_ = arrive(commanded);
  ++moves_;
  machine_seconds_ += at_.travel_seconds + settle_seconds_;
  return at_;
}

// Uses the linear map like every other move, so that the reached pose can be commanded again, and recommended, bit for
// bit.
StageMotion::Arrival StageMotion::move_by(const std::vector<double>& delta) {
  if (delta.size() != at_.reached_pose.size())
    throw Error(ErrorKind::internal, "the move and the stage have different numbers of axes");
  std::vector<double> commanded = at_.reached_pose;
  for (std::size_t i = 0; i < delta.size(); ++i) commanded[i] += delta[i];
  return step_to(commanded);
}

}  // namespace relign::trials
