// Aggregate statistics of each method over all strata of a study, with intervals, as rliable recommends (Agarwal et
// al., Deep Reinforcement Learning at the Edge of the Statistical Precipice, NeurIPS 2021). Inputs are normalised
// errors (normalised_error.h), 0 to 1, lower is better.
//
// A method has one or more trainings, all evaluated on the same instances; a method that is not trained has one. For
// several trainings both trainings and instances are resampled (stratified.h).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "statistics/band.h"
#include "statistics/stratified.h"

namespace relign::statistics {

struct MethodErrors {
  StratifiedValues last, area;  // normalised error after the last step; its mean over the steps. Equal shapes
};

// All strata have equal weight, and so have the values within a stratum. In terms of rliable's score s = 1 - e:
struct AggregateBands {
  Band iqm;     // 1 - aggregate_iqm(s) if 4 divides the number of values (OrderStatistic::iqm cuts fractions)
  Band median;  // of all values; rliable's aggregate_median of strata's means says little for a few strata
  Band gap;     // aggregate_optimality_gap(s, gamma = 1), which is the mean of e
  Band area;    // the gap averaged over the steps: area under the error curve (AUC), 1 at most
  std::vector<Band> profile;  // performance profile: share of values with e at or below each of profile_places()
};

// Probability that `first` ends below `second` on the same instance; ties count half. Averaged over the instances of a
// stratum, then over the strata; with several trainings over all pairs of one training each. This is rliable's
// probability_of_improvement with instances as tasks and trainings as runs.
struct Improvement {
  std::size_t first = 0, second = 0;
  Band share;
};

struct Aggregates {
  std::vector<AggregateBands> methods;
  std::vector<Improvement> pairs;
};

// Places of the performance profile: 0, 0.025 ... 1.
std::vector<double> profile_places();

// Intervals are expanded percentile intervals (bootstrap.h) for the number of instances in the smallest stratum, or of
// trainings if there are fewer; none without resamples (0). The first method with several trainings draws them at level
// 1 of the resampling's seed, the next at level 2, and so on. `pairs`: indices of two methods each. Throws Error
// (internal) if the shape of the values is not that of the resampling.
Aggregates aggregate(const StratifiedResampling& resampling, const std::vector<MethodErrors>& methods,
                     const std::vector<std::pair<std::size_t, std::size_t>>& pairs, Parallel& parallel);

}  // namespace relign::statistics
