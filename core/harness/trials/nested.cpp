#include "trials/nested.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "trials/trial_host.h"

namespace relign::trials {
namespace {}  // namespace

NestedTrial::NestedTrial(TrialHost& host, TrialView& outer, const plugin_host::Choice& inner, unsigned budget,
                         std::uint64_t seed, double largest_move)
    : host_(&host), outer_(&outer), inner_(&inner), services_(host, *this) {
  const relign_task& outer_task = *outer.table().task;
  task_ = outer_task;
  task_.observes = outer_task.observes & inner.plugin->observed_bits();

  relign_observation here{};
  here.struct_size = sizeof here;
  outer.write_observation(&here);
  origin_.assign(outer_task.axes, 0.0);
  // Without the start, coordinates are relative to the pose at which the inner algorithm starts.
  if (!(task_.observes & RELIGN_OBSERVES_START)) origin_.assign(here.pose, here.pose + outer_task.axes);
  describe_task(seed, budget, largest_move);
  best_.merit = std::numeric_limits<double>::infinity();
  take_outer_observation();
}

void NestedTrial::describe_task(std::uint64_t seed, unsigned budget, double largest_move) {
  const relign_task& outer_task = *outer_->table().task;
  task_.struct_size = sizeof task_;
  task_.budget = budget;
  task_.seed = seed;
  task_.largest_move = std::min(largest_move, outer_task.largest_move);
  task_.box_lower = nullptr;
  task_.box_upper = nullptr;
  if (task_.observes & RELIGN_OBSERVES_BOX) {
    // The outer box, except where it would reveal the start to an algorithm that may not observe it.
    const bool would_reveal_start = outer_task.observes & ~task_.observes & RELIGN_OBSERVES_START;
    for (std::size_t i = 0; i < origin_.size(); ++i) {
      box_lower_.push_back(would_reveal_start ? -kBlindHalfBox : outer_task.box_lower[i] - origin_[i]);
      box_upper_.push_back(would_reveal_start ? kBlindHalfBox : outer_task.box_upper[i] - origin_[i]);
    }
    task_.box_lower = box_lower_.data();
    task_.box_upper = box_upper_.data();
  }
  if (!(task_.observes & RELIGN_OBSERVES_IMAGES)) task_.image_width = task_.image_height = 0;

  table_.struct_size = sizeof table_;
  table_.context = this;
  table_.task = &task_;
  table_.first = [](void* context, relign_observation* observation) {
    NestedTrial& nested = self(context);
    if (!observation || observation->struct_size < kMinObservationSize || nested.steps_ != 0)
      return nested.host_->refuse(RELIGN_BAD_ARGUMENT);
    nested.write_observation(observation);
    return relign_status{RELIGN_OK};
  };
  table_.step = [](void* context, const double* pose, std::uint32_t axes, relign_observation* observation) {
    return self(context).request(pose, axes, false, observation);
  };
  table_.move = [](void* context, const double* delta, std::uint32_t axes, relign_observation* observation) {
    return self(context).request(delta, axes, true, observation);
  };
  table_.recommend = [](void* context, const double* pose, std::uint32_t axes) {
    return self(context).recommend(pose, axes);
  };
  table_.get_service = [](void* context, relign_text id) -> const void* {
    return id.data ? self(context).services_.get({id.data, static_cast<std::size_t>(id.size)}) : nullptr;
  };
  table_.why = [](void* context, const relign_text_sink* reason) { return self(context).services_.why(reason); };
}

void NestedTrial::take_outer_observation() {
  relign_observation latest{};
  latest.struct_size = sizeof latest;
  outer_->write_observation(&latest);
  if (latest.merit < best_.merit && host_->shows_all()) {
    best_pose_.assign(latest.pose, latest.pose + task_.axes);
    best_ = latest;
    best_.pose = best_pose_.data();
  }
  pose_.assign(latest.pose, latest.pose + task_.axes);
  for (std::size_t i = 0; i < pose_.size(); ++i) pose_[i] -= origin_[i];
  observation_ = latest;
  observation_.step = steps_;
  observation_.pose = pose_.data();
  if (!(task_.observes & RELIGN_OBSERVES_MERIT)) observation_.merit = std::numeric_limits<double>::quiet_NaN();
  if (!(task_.observes & RELIGN_OBSERVES_IMAGES)) observation_.image = nullptr;
}

void NestedTrial::write_observation(relign_observation* observation) const {
  relign_observation all = observation_;
  all.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(observation->struct_size, sizeof all));
  std::memcpy(observation, &all, all.struct_size);
}

relign_status NestedTrial::request(const double* values, std::uint32_t axes, bool relative,
                                   relign_observation* observation) {
  const relign_trial& outer = outer_->table();
  if (steps_ >= task_.budget) {
    stopped_ = true;
    return host_->refuse(RELIGN_STOP);
  }
  if (!observation || observation->struct_size < kMinObservationSize || !values || axes != task_.axes)
    return host_->refuse(RELIGN_BAD_ARGUMENT);
  std::vector<double> outer_values(values, values + axes);
  if (!relative)
    for (std::size_t i = 0; i < outer_values.size(); ++i) outer_values[i] += origin_[i];
  relign_observation answer{};
  answer.struct_size = sizeof answer;
  const relign_status status = (relative ? outer.move : outer.step)(outer.context, outer_values.data(), axes, &answer);
  if (status == RELIGN_STOP) stopped_ = true;
  if (status != RELIGN_OK) return status;
  ++steps_;
  take_outer_observation();
  // Returns a commanded pose exactly as given, without the rounding of two shifts.
  if (!relative)
    for (std::size_t i = 0; i < pose_.size(); ++i)
      if (answer.pose[i] == outer_values[i]) pose_[i] = values[i];
  write_observation(observation);
  return RELIGN_OK;
}

relign_status NestedTrial::recommend(const double* pose, std::uint32_t axes) {
  if (!pose || axes != task_.axes || !std::all_of(pose, pose + axes, [](double v) { return std::isfinite(v); }))
    return host_->refuse(RELIGN_BAD_ARGUMENT);
  recommendation_.emplace(pose, pose + axes);
  for (std::size_t i = 0; i < origin_.size(); ++i) (*recommendation_)[i] += origin_[i];
  return RELIGN_OK;
}

}  // namespace relign::trials
