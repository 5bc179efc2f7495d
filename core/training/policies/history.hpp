// What a policy with a memory observes: earlier captures' poses and readings, as one row of numbers.
#pragma once

#include <relign/basics.hpp>
#include <string>
#include <vector>

namespace relign::policies {

// "observation" of a side file: how captures become numbers. relign-train has the same rules (training/history.py).
struct HistoryFormat {
  int last = 0;  // slots for the latest captures, the newest last
  int best = 0;  // slots before them for the captures with the lowest score, the lowest first; needs `score`
  std::size_t axes = 0;
  double fine_move = 0;  // of the signed logarithm of moves, in shares of the travel
  // Per reading; empty for a scene without readings, whose slots have poses only.
  std::vector<std::string> readings;    // names
  std::vector<std::string> units;       // of the readings; empty texts where they have none
  std::vector<double> mean, deviation;  // the first number of a reading is (value - mean) / deviation
  std::vector<double> fine;             // of its signed logarithm, in the reading's unit
  int score = -1;                       // the reading that measures the score, -1: none does

  std::size_t slot() const { return 1 + 2 * axes + 2 * readings.size(); }
  // Numbers of the network's input.
  std::size_t count() const { return static_cast<std::size_t>(last + best) * slot(); }
};

// The captures of one trial so far.
class History {
 public:
  explicit History(const HistoryFormat& format) : format_(&format) {}

  // readings: as many as in the format.
  void add(const Pose& commanded, const std::vector<float>& readings);

  // Each slot: 1 where it is filled; per axis the pose minus the latest one, and its signed logarithm; per reading the
  // normalised value and its signed logarithm. A slot that is not filled is all zeros.
  std::vector<float> input() const;

  // The pose with the lowest score, the first of equal ones. Needs format.score and a capture.
  const Pose& best() const { return captures_[ranked_.front()].pose; }

 private:
  struct Capture {
    Pose pose;
    std::vector<float> readings;
  };

  const HistoryFormat* format_;
  std::vector<Capture> captures_;
  std::vector<std::size_t> ranked_;  // by score, the lowest first; at most max(best, 1)
};

// sign(x) log(1 + |x| / fine), the same bits on every processor.
double signed_log(double x, double fine);

}  // namespace relign::policies
