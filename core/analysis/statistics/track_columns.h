// The tracks of one series, step by step: what curves, bands and tests are made of.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "statistics/trial_table.h"

namespace relign::statistics {

struct StepRange {
  unsigned first = 0, last = 0;  // both included
};

// One trial of a series as it is read; all of it is gone with the next one.
struct ReadTrial {
  std::size_t place = 0;  // in Series::trials
  const TrialRow& row;
  const std::vector<records::StepNumbers>& steps;
  const records::StoredSteps& stored;
};
// Every trial of the series, in their order. Throws Error as StoredSteps::read does.
void for_each_trial(const TrialTable& table, const Series& series, const std::function<void(const ReadTrial&)>& visit);

// Values of some tracks at some steps over the trials of a series, in the order of Series::trials. A trial that ended
// early carries its last step forward; NaN: the trial has no value there.
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
