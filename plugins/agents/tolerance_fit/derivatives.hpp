// Derivatives of the model's images by (pose, state). A new derivative costs one image per parameter, so derivatives
// are reused for similar images.
#pragma once

#include <deque>
#include <limits>
#include <utility>

#include "knowledge.hpp"
#include "transport.hpp"

namespace tolerance_fit {

inline Vector joined(const Vector& pose, const Vector& state) {
  Vector both(pose.size() + state.size());
  both << pose, state;
  return both;
}

class Derivatives {
 public:
  // change: image change per stride, in standard deviations of a capture's noise. shortest: shortest stride, share of
  // the travel.
  struct Rules {
    double change = 15, shortest = 0.0015;
    double reach = 15;       // a derivative is reused for images that differ by at most this, in the same unit
    bool transport = false;  // shift derivatives with the image before they are reused
  };

  Derivatives(const Knowledge& known, Pictures& pictures, Detail detail, Rules rules)
      : known_(known), pictures_(pictures), detail_(detail), rules_(rules) {}

  Detail detail() const { return detail_; }
  int made() const { return made_; }  // images rendered
  // Limits the number of further images; beyond it no derivative is computed if there is an old one.
  void allow(int pictures) { last_ = made_ + pictures; }
  int left() const { return last_ - made_; }

  Vector look(const Vector& pose, const Vector& state) {
    for (const auto& [place, picture] : recent_)
      if (place == joined(pose, state)) return picture;
    ++made_;
    recent_.emplace_front(joined(pose, state), pictures_.look(pose, state, detail_));
    if (recent_.size() > kMaxKept) recent_.pop_back();
    return recent_.front().second;
  }

  // bins x (pose, state)
  const Matrix& at(const Vector& pose, const Vector& state) {
    const Vector place = joined(pose, state);
    for (const Known& known : known_at_)
      if (known.place == place) return known.slopes;
    Known made = nearest(place, look(pose, state));
    if (made.slopes.size() == 0 || (made.distance > rules_.reach && made_ + place.size() <= last_))
      made = differenced(pose, state);
    if (known_at_.size() >= kMaxKept) known_at_.pop_back();
    known_at_.push_front(std::move(made));
    return known_at_.front().slopes;
  }

 private:
  static constexpr std::size_t kMaxKept = 8;
  static constexpr double kLongestMove = 0.15, kLongestState = 1;

  struct Known {
    Vector place, origin;  // (pose, state) it is used for; where it was computed
    Vector picture;        // image at the origin
    Matrix slopes, original;
    double distance = 0;  // in standard deviations of noise
  };

  // The stored derivative whose image is most similar, shifted with the image if `transport` is set.
  Known nearest(const Vector& place, const Vector& picture) const {
    Known best;
    best.distance = std::numeric_limits<double>::infinity();
    const Known* from = nullptr;
    const Vector weight = known_.variance(picture, detail_).cwiseSqrt().cwiseInverse();
    const auto width = static_cast<Eigen::Index>(pictures_.size().width / detail_.bin);
    Shift shift;
    for (const Known& old : known_at_) {
      double distance = known_.distance(place - old.origin);
      Shift by;
      if (rules_.transport) {
        by = shift_between(old.picture, picture, weight, width);
        distance = (moved(old.picture, width, by) - picture).cwiseProduct(weight).norm();
      }
      if (distance < best.distance) best.distance = distance, from = &old, shift = by;
    }
    if (!from) return best;
    best.place = place;
    best.origin = from->origin;
    best.picture = from->picture;
    best.original = best.slopes = from->original;
    if (rules_.transport)
      for (Eigen::Index i = 0; i < best.slopes.cols(); ++i)
        best.slopes.col(i) = moved(from->original.col(i), width, shift);
    return best;
  }

  Known differenced(const Vector& pose, const Vector& state) {
    const Vector place = joined(pose, state);
    const Eigen::Index n = known_.axes();
    const Vector base = look(pose, state);
    Matrix slopes(base.size(), place.size());
    for (Eigen::Index i = 0; i < place.size(); ++i) {
      const Vector direction = known_.directions.col(i);
      Vector step = length(i) * direction;
      // Step towards the side with more room on the axis that moves most.
      Eigen::Index axis = 0;
      const double farthest = step.head(n).cwiseAbs().maxCoeff(&axis);
      if (farthest > 0 && (step[axis] > 0) == (pose[axis] > 0.5)) step = -step;
      ++made_;
      const Vector there = pictures_.look(pose + step.head(n), state + step.tail(place.size() - n), detail_);
      slopes.col(i) = (there - base) / step.dot(direction);
    }
    Known made{place, place, base, slopes * known_.directions.transpose(), {}, 0};
    made.original = made.slopes;
    return made;
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
  std::deque<Known> known_at_;  // the last used first
  std::deque<std::pair<Vector, Vector>> recent_;
  int made_ = 0, last_ = std::numeric_limits<int>::max();
};

}  // namespace tolerance_fit
