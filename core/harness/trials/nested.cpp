#include "trials/nested.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "trials/conversation.h"

namespace relign::trials {
namespace {

constexpr double kHalfBox = 0.5;  // as under the protocol "blind"

}  // namespace

NestedConversation::NestedConversation(Conversation& host, Seat& outer, const plugin_host::Choice& inner,
                                       unsigned budget, std::uint64_t seed, double largest_move)
    : host_(&host), outer_(&outer), inner_(&inner), services_(host, *this) {
  const relign_task& theirs = *outer.table().task;
  task_ = theirs;
  task_.knows = theirs.knows & inner.plugin->knows_bits();

  relign_observation here{};
  here.struct_size = sizeof here;
  outer.tell(&here);
  origin_.assign(theirs.axes, 0.0);
  // Whoever does not know the start counts from where it starts itself.
  if (!(task_.knows & RELIGN_KNOWS_START)) origin_.assign(here.pose, here.pose + theirs.axes);
  describe_task(seed, budget, largest_move);
  best_.merit = std::numeric_limits<double>::infinity();
  look();
}

void NestedConversation::describe_task(std::uint64_t seed, unsigned budget, double largest_move) {
  const relign_task& theirs = *outer_->table().task;
  task_.struct_size = sizeof task_;
  task_.budget = budget;
  task_.seed = seed;
  task_.largest_move = std::min(largest_move, theirs.largest_move);
  task_.box_lower = nullptr;
  task_.box_upper = nullptr;
  if (task_.knows & RELIGN_KNOWS_BOX) {
    // The outer one's box; but that would tell the start to an algorithm that must not know it.
    const bool would_tell_start = theirs.knows & ~task_.knows & RELIGN_KNOWS_START;
    for (std::size_t i = 0; i < origin_.size(); ++i) {
      box_lower_.push_back(would_tell_start ? -kHalfBox : theirs.box_lower[i] - origin_[i]);
      box_upper_.push_back(would_tell_start ? kHalfBox : theirs.box_upper[i] - origin_[i]);
    }
    task_.box_lower = box_lower_.data();
    task_.box_upper = box_upper_.data();
  }
  if (!(task_.knows & RELIGN_KNOWS_IMAGES)) task_.image_width = task_.image_height = 0;

  table_.struct_size = sizeof table_;
  table_.context = this;
  table_.task = &task_;
  table_.first = [](void* context, relign_observation* seen) {
    NestedConversation& nested = self(context);
    if (!seen || seen->struct_size < kSmallestObservation || nested.steps_ != 0)
      return nested.host_->refuse(RELIGN_BAD_ARGUMENT);
    nested.tell(seen);
    return relign_status{RELIGN_OK};
  };
  table_.step = [](void* context, const double* pose, std::uint32_t axes, relign_observation* seen) {
    return self(context).request(pose, axes, false, seen);
  };
  table_.move = [](void* context, const double* delta, std::uint32_t axes, relign_observation* seen) {
    return self(context).request(delta, axes, true, seen);
  };
  table_.recommend = [](void* context, const double* pose, std::uint32_t axes) {
    return self(context).recommend(pose, axes);
  };
  table_.get_service = [](void* context, relign_text id) -> const void* {
    return id.data ? self(context).services_.get({id.data, static_cast<std::size_t>(id.size)}) : nullptr;
  };
}

void NestedConversation::look() {
  relign_observation theirs{};
  theirs.struct_size = sizeof theirs;
  outer_->tell(&theirs);
  if (theirs.merit < best_.merit) {
    best_pose_.assign(theirs.pose, theirs.pose + task_.axes);
    best_ = theirs;
    best_.pose = best_pose_.data();
  }
  pose_.assign(theirs.pose, theirs.pose + task_.axes);
  for (std::size_t i = 0; i < pose_.size(); ++i) pose_[i] -= origin_[i];
  seen_ = theirs;
  seen_.step = steps_;
  seen_.pose = pose_.data();
  if (!(task_.knows & RELIGN_KNOWS_MERIT)) seen_.merit = std::numeric_limits<double>::quiet_NaN();
  if (!(task_.knows & RELIGN_KNOWS_IMAGES)) seen_.image = nullptr;
}

void NestedConversation::tell(relign_observation* seen) const {
  relign_observation all = seen_;
  all.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(seen->struct_size, sizeof all));
  std::memcpy(seen, &all, all.struct_size);
}

relign_status NestedConversation::request(const double* values, std::uint32_t axes, bool relative,
                                          relign_observation* seen) {
  const relign_conversation& outer = outer_->table();
  if (steps_ >= task_.budget) {
    told_to_stop_ = true;
    return host_->refuse(RELIGN_STOP);
  }
  if (!seen || seen->struct_size < kSmallestObservation || !values || axes != task_.axes)
    return host_->refuse(RELIGN_BAD_ARGUMENT);
  std::vector<double> theirs(values, values + axes);
  if (!relative)
    for (std::size_t i = 0; i < theirs.size(); ++i) theirs[i] += origin_[i];
  relign_observation answer{};
  answer.struct_size = sizeof answer;
  const relign_status status = (relative ? outer.move : outer.step)(outer.context, theirs.data(), axes, &answer);
  if (status == RELIGN_STOP) told_to_stop_ = true;
  if (status != RELIGN_OK) return status;
  ++steps_;
  look();
  // What was commanded comes back as it was said, without the rounding of two shifts.
  if (!relative)
    for (std::size_t i = 0; i < pose_.size(); ++i)
      if (answer.pose[i] == theirs[i]) pose_[i] = values[i];
  tell(seen);
  return RELIGN_OK;
}

relign_status NestedConversation::recommend(const double* pose, std::uint32_t axes) {
  if (!pose || axes != task_.axes || !std::all_of(pose, pose + axes, [](double v) { return std::isfinite(v); }))
    return host_->refuse(RELIGN_BAD_ARGUMENT);
  recommendation_.emplace(pose, pose + axes);
  for (std::size_t i = 0; i < origin_.size(); ++i) (*recommendation_)[i] += origin_[i];
  return RELIGN_OK;
}

}  // namespace relign::trials
