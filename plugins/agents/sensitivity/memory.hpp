// Combines the estimates from all captures of a trial into one of the best pose.
#pragma once

#include <deque>
#include <utility>

#include "belief.hpp"

namespace sensitivity {

class Memory {
 public:
  struct Errors {
    double spread = 0.3;  // standard deviation of the start's distance from the best pose, per axis
    double stage = 0.01;  // error of the stage, as a share of the move
    double gain = 0.2;    // deviation of the lens's sensitivities from the design's, as a share
    Matrix foreign;       // covariance due to differences between the design's images and the lens's, at distance 1
  };

  // All poses are commanded poses.
  Memory(const Vector& start, Errors errors)
      : errors_(std::move(errors)), before_(Belief::around(start, errors_.spread)), best_(before_) {}

  const Belief& best() const { return best_; }
  // The same with the error of the stage in a move from `at` to `goal`.
  Belief best_after_move(const Vector& at, const Vector& goal) const {
    const double error = errors_.stage * errors_.stage * (goal - at).squaredNorm();
    return best_.inflated(error * Matrix::Identity(at.size(), at.size()));
  }

  // away: belief about the displacement from the best pose to `at`.
  void add(const Vector& at, const Belief& away) {
    history_.emplace_back(at, away);
    if (history_.size() > kMost) history_.pop_front();
    combine();
  }
  void reset(const Vector& at) {
    history_.clear();
    before_ = best_ = Belief::around(at, errors_.spread);
  }

 private:
  static constexpr std::size_t kMost = 300;
  static constexpr int kRounds = 3;

  // An estimate has an error proportional to its distance from the best pose, which is not known in advance. All
  // estimates are therefore weighted again whenever one is added: the first moves follow the newest estimate in full,
  // later ones average the estimates made near the best pose.
  void combine() {
    const Matrix one = Matrix::Identity(best_.weighed.size(), best_.weighed.size());
    for (int round = 0; round < kRounds; ++round) {
      const Vector goal = best_.mean();
      best_ = before_;
      for (const auto& [at, away] : history_) {
        const Vector way = at - goal;
        const double square = way.squaredNorm();
        const Matrix error = errors_.gain * errors_.gain * way * way.transpose() +
                             square * (errors_.stage * errors_.stage * one + errors_.foreign);
        best_ = best_.with(away.inflated(error).best_pose_from(at));
      }
    }
  }

  Errors errors_;
  Belief before_, best_;
  std::deque<std::pair<Vector, Belief>> history_;
};

}  // namespace sensitivity
