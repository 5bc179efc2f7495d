// The aggregates of a study: one number a method over all scenes and noise levels. Used by study.cpp alone.
#pragma once

#include <vector>

#include "statistics/study.h"
#include "statistics/track_columns.h"

namespace relign::statistics {

// Normalised errors of a series, gathered while its trials' steps are at hand. A trial without truth at any of its
// steps has none (NaN).
struct SeriesErrors {
  SeriesErrors(const Series& series, Rule rule);
  void add(const ReadTrial& trial);

  Rule rule;
  std::vector<double> last, area;  // one a trial of the series
  std::vector<double> by_step;     // sums over the trials that have a value, from step 0 to the largest budget
  std::size_t known = 0;           // trials that have one
};

// `study`: its groups and series; errors[i] of study.series[i], let go as they are used.
std::vector<AggregateStudy> aggregates_of(const TrialTable& table, const Study& study, std::vector<SeriesErrors> errors,
                                          const StudyOptions& options, Parallel& parallel);

}  // namespace relign::statistics
