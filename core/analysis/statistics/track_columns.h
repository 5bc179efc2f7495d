// Tracks of one series as columns per step, the input of curves, bands and tests.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "statistics/trial_table.h"

namespace relign::statistics {

struct StepRange {
  unsigned first = 0, last = 0;  // both included
};

// One trial of a series while it is read; valid until the next one.
struct ReadTrial {
  std::size_t place = 0;  // in Series::trials
  const Series& series;
  const TrialRow& row;
  const std::vector<records::StepNumbers>& steps;
  const records::StoredSteps& stored;
};
// Visits the trials of the series in order. Throws Error as StoredSteps::read.
void for_each_trial(const TrialTable& table, const Series& series, const std::function<void(const ReadTrial&)>& visit);

// Values of some tracks at some steps over the trials of a series, in the order of Series::trials. A trial that ended
// early keeps its last step; NaN if the trial has no value.
class TrackColumns {
 public:
  TrackColumns(std::size_t trials, std::vector<Track> tracks, StepRange steps);
  void add(const ReadTrial& trial);

  std::vector<double> at(Track track, unsigned step) const;

  static std::size_t bytes(std::size_t trials, std::size_t tracks, std::size_t steps) {
    return trials * tracks * steps * sizeof(double);
  }

 private:
  std::vector<Track> tracks_;
  StepRange steps_;
  std::size_t trials_;
  std::vector<double> values_;  // [track][step][trial]
};

}  // namespace relign::statistics
