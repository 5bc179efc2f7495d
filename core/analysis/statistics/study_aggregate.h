// Aggregates of a study: each method over all scenes and noise levels. Used by study.cpp only.
#pragma once

#include <vector>

#include "statistics/study.h"
#include "statistics/track_columns.h"

namespace relign::statistics {

// Normalised errors of a series, collected while the steps of its trials are in memory. NaN for a trial that lacks
// ground truth at any step.
struct SeriesErrors {
  SeriesErrors(const Series& series, Rule rule);
  void add(const ReadTrial& trial);

  Rule rule;
  std::vector<double> last, area;  // one per trial of the series
  std::vector<double> by_step;     // sums over trials with a value, step 0 to the largest budget
  std::size_t known = 0;           // trials with a value
};

// `study` needs its groups and series; errors[i] belongs to study.series[i] and is released as it is used.
std::vector<AggregateStudy> aggregates_of(const TrialTable& table, const Study& study, std::vector<SeriesErrors> errors,
                                          const StudyOptions& options, Parallel& parallel);

}  // namespace relign::statistics
