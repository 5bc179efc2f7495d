// The tracks of one series, step by step: what curves, bands and tests are made of.
#pragma once

#include <cstddef>
#include <vector>

#include "stats/trial_table.h"

namespace relign::stats {

struct StepRange {
  unsigned first = 0, last = 0;  // both included
};

// Values of some tracks at some steps over the trials of a series, in the order of Series::trials. A trial that ended
// early carries its last step forward; NaN: the trial has no value there.
class TrackColumns {
 public:
  // Reads every trial of the series once. Throws Error as StoredSteps::read does.
  TrackColumns(const TrialTable& table, const Series& series, std::vector<Track> tracks, StepRange steps);

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

}  // namespace relign::stats
