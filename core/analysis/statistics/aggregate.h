// One number with its interval for each method over all strata of a study, as rliable recommends them (Agarwal et al.,
// Deep Reinforcement Learning at the Edge of the Statistical Precipice, NeurIPS 2021), for normalised errors
// (normalised_error.h): lower is better, 0 to 1.
//
// A method is a list of trainings, each of which met the same instances, or one thing that ran once: then it has one
// "training". Of a list both trainings and instances are resampled (stratified.h).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "statistics/band.h"
#include "statistics/stratified.h"

namespace relign::statistics {

struct MethodErrors {
  StratifiedValues last, area;  // normalised error after the last step; mean over the steps. Equal shapes
};

// Every stratum weighs the same, each of its values as much as the others there. With s = 1 - e as the score of
// rliable:
struct AggregateBands {
  Band iqm;     // 1 - aggregate_iqm(s) where 4 divides the number of values (OrderStatistic::iqm cuts fractions)
  Band median;  // of all values; aggregate_median is of strata's means, and means little for a few strata
  Band gap;     // aggregate_optimality_gap(s, gamma = 1), which is the mean of e
  Band area;    // the gap, averaged over the steps: area under the error curve (AUC) as a share of the largest
  std::vector<Band> profile;  // performance profile: share of the values with e at or below each place
};

// Probability that `first` ends below `second` on an instance, draws counting half, averaged over the instances of a
// stratum and then over the strata; of lists of trainings over all pairs of one training each. As rliable's
// probability_of_improvement with every instance as a task and every training as a run of it: instances are the same
// for both, and are compared with themselves.
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

// Of the methods with two trainings or more the first draws them at level 1 of the resampling's seed, the next at level
// 2, and so on. Intervals are expanded percentile intervals (bootstrap.h) for the number of instances in the smallest
// stratum, or of trainings if there are fewer; without resamples (0) there are none. `pairs`: of methods, first and
// second. Throws Error (internal) for values of other shapes than the resampling's.
Aggregates aggregate(const StratifiedResampling& resampling, const std::vector<MethodErrors>& methods,
                     const std::vector<std::pair<std::size_t, std::size_t>>& pairs, Parallel& parallel);

}  // namespace relign::statistics
