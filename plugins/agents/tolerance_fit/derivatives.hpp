// The model's images around some places (pose, state), each with its derivatives.
#pragma once

#include <algorithm>
#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include "knowledge.hpp"

namespace tolerance_fit {

inline Vector joined(const Vector& pose, const Vector& state) {
  Vector both(pose.size() + state.size());
  both << pose, state;
  return both;
}

class Derivatives {
 public:
  // reach: an expansion serves places whose image differs by at most this, in standard deviations of a capture's noise.
  // For models without derivatives, change: of the image per stride, in the same unit; shortest: stride, share of the
  // travel.
  struct Rules {
    double reach = 6, change = 15, shortest = 0.0015;
  };
  struct Expansion {
    Vector place, picture;
    Matrix slopes;    // bins x (pose, state)
    int renders = 1;  // averaged
    Vector at(const Vector& there) const { return picture + slopes * (there - place); }
  };

  Derivatives(const Knowledge& known, Pictures& pictures, Detail detail, Rules rules)
      : known_(known), pictures_(pictures), detail_(detail), rules_(rules) {}

  Detail detail() const { return detail_; }

  // The expansion nearest to a place, if need be a new one.
  const Expansion& around(const Vector& pose, const Vector& state) {
    const Vector place = on_the_travel(pose, state);
    auto nearest = kept_.end();
    double least = rules_.reach;
    for (auto each = kept_.begin(); each != kept_.end(); ++each)
      if (const double away = known_.distance(place - each->place); away <= least) nearest = each, least = away;
    if (nearest == kept_.end()) {
      if (kept_.size() >= kMaxKept) kept_.pop_back();
      kept_.push_front(made(place));
    } else if (nearest != kept_.begin()) {
      Expansion used = std::move(*nearest);
      kept_.erase(nearest);
      kept_.push_front(std::move(used));
    }
    return kept_.front();
  }

  // The image at a place.
  Vector look(const Vector& pose, const Vector& state) { return around(pose, state).at(on_the_travel(pose, state)); }

  // Renders a place once more, with other rays: errors of pictures and derivatives average out.
  void improve(const Vector& pose, const Vector& state) {
    const int seeds = seed_;
    const Expansion& there = around(pose, state);
    if (seed_ == 0 || seed_ != seeds || there.renders >= kMostRenders) return;  // 0: by differences, without noise
    Expansion more = made(on_the_travel(pose, state));
    Expansion& kept = kept_.front();
    const double share = 1.0 / ++kept.renders;
    more.picture = share * more.picture + (1 - share) * kept.at(more.place);
    kept.slopes += share * (more.slopes - kept.slopes);
    kept.picture = std::move(more.picture);
    kept.place = std::move(more.place);
  }

  // Those that serve a place, and all others within this distance, in standard deviations of noise.
  std::vector<const Expansion*> within(double distance, const Vector& pose, const Vector& state) {
    const Vector place = on_the_travel(pose, state);
    around(pose, state);
    std::vector<const Expansion*> near;
    for (const Expansion& each : kept_)
      if (known_.distance(place - each.place) <= distance) near.push_back(&each);
    return near;
  }

 private:
  static constexpr std::size_t kMaxKept = 16;
  static constexpr int kMostRenders = 16;
  static constexpr double kLongestMove = 0.15, kLongestState = 1;

  static Vector on_the_travel(const Vector& pose, const Vector& state) {
    return joined(pose.cwiseMax(0).cwiseMin(1), state);
  }

  Expansion made(const Vector& place) {
    const Eigen::Index n = known_.axes();
    const Vector pose = place.head(n), state = place.tail(place.size() - n);
    // Another seed each time: errors of the expansions are independent.
    if (auto found = pictures_.slopes(pose, state, detail_, static_cast<std::uint64_t>(seed_) + 1)) {
      ++seed_;
      return {place, std::move(found->first), std::move(found->second)};
    }
    const Vector base = pictures_.look(pose, state, detail_);
    Matrix slopes(base.size(), place.size());
    for (Eigen::Index i = 0; i < place.size(); ++i) {
      const Vector direction = known_.directions.col(i);
      Vector step = length(i) * direction;
      // Step towards the side with more room on the axis that moves most.
      Eigen::Index axis = 0;
      const double farthest = step.head(n).cwiseAbs().maxCoeff(&axis);
      if (farthest > 0 && (step[axis] > 0) == (pose[axis] > 0.5)) step = -step;
      const Vector there = pictures_.look(pose + step.head(n), state + step.tail(state.size()), detail_);
      slopes.col(i) = (there - base) / step.dot(direction);
    }
    return {place, base, slopes * known_.directions.transpose()};
  }

  double length(Eigen::Index i) const {
    const Eigen::Index n = known_.axes();
    const Vector direction = known_.directions.col(i).cwiseAbs();
    double longest = kLongestMove / std::max(direction.head(n).maxCoeff(), 1e-9);
    if (direction.size() > n)
      longest = std::min(longest, kLongestState / std::max(direction.tail(direction.size() - n).maxCoeff(), 1e-9));
    return std::min(longest, std::max(rules_.shortest, rules_.change / std::sqrt(known_.information[i])));
  }

  const Knowledge& known_;
  Pictures& pictures_;
  Detail detail_;
  Rules rules_;
  std::deque<Expansion> kept_;  // the last used first
  int seed_ = 0;
};

}  // namespace tolerance_fit
