// What all captures of a trial tell together of where the best pose is.
#pragma once

#include <deque>
#include <utility>

#include "belief.hpp"

namespace sensitivity {

class Memory {
 public:
  struct Doubts {
    double spread = 0.3;  // standard deviation of a start's distance from the best pose
    double stage = 0.01;  // a stage misses a move by this share of it
    double gain = 0.2;    // a lens's own sensitivities differ from the design's by this share
    Matrix foreign;       // covariance of what the design's pictures differ by, at distance 1
  };

  // All in commanded coordinates.
  Memory(const Vector& start, Doubts doubts)
      : doubts_(std::move(doubts)), before_(Belief::around(start, doubts_.spread)), best_(before_) {}

  const Belief& best() const { return best_; }

  // away: of the way from the best pose to `at`.
  void add(const Vector& at, const Belief& away) {
    seen_.emplace_back(at, away);
    if (seen_.size() > kMost) seen_.pop_front();
    put_together();
  }
  void begin_anew(const Vector& at) {
    seen_.clear();
    before_ = best_ = Belief::around(at, doubts_.spread);
  }

 private:
  static constexpr std::size_t kMost = 300;
  static constexpr int kRounds = 3;

  // What was seen from afar is off by a share of the way, and how far it was shows as the best pose gets clearer. So
  // all is weighed anew every time: whole steps at first, an average of what was seen near the end.
  void put_together() {
    const Matrix one = Matrix::Identity(best_.weighed.size(), best_.weighed.size());
    for (int round = 0; round < kRounds; ++round) {
      const Vector goal = best_.mean();
      best_ = before_;
      for (const auto& [at, away] : seen_) {
        const Vector way = at - goal;
        const double square = way.squaredNorm();
        const Matrix doubt = doubts_.gain * doubts_.gain * way * way.transpose() +
                             square * (doubts_.stage * doubts_.stage * one + doubts_.foreign);
        best_ = best_.with(away.blunted(doubt).seen_from(at));
      }
    }
  }

  Doubts doubts_;
  Belief before_, best_;
  std::deque<std::pair<Vector, Belief>> seen_;
};

}  // namespace sensitivity
