// Two algorithms on the same instances: by how much, how surely, and does it matter?
//
// All from the differences instance by instance (first minus second), so that what an instance does to both cancels.
// Lower values are better throughout: RMSE, steps to a target.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"
#include "statistics/order_statistic.h"
#include "statistics/resampling.h"
#include "statistics/signed_rank.h"

namespace relign::statistics {

// log: differences of natural logarithms, so exp() of them is a ratio and log(1.05) is "5 % worse". For RMSE, whose
// size differs between instances by factors.
enum class Scale { raw, logarithmic };

// One an instance: NaN where either value is NaN, 0 where both are equal, infinite values included (neither arrived).
// Throws Error (internal) for columns of different lengths, (bad_input) for the logarithm of a negative value.
std::vector<double> paired_differences(const std::vector<double>& first, const std::vector<double>& second,
                                       Scale scale);

// What the interval of the difference says about the smallest difference that matters, d:
//   better: all of it below -d      worse: all of it above d      practically equal: all of it within -d to d
// Anything else, and no interval at all, is undecided: measure more instances. "Better" by less than d is never said.
enum class Verdict { better, worse, practically_equal, undecided };
const char* verdict_name(Verdict verdict);  // "practically equal"
Verdict verdict_of(const Interval& difference, double smallest_relevant);

struct PairedOptions {
  Scale scale = Scale::logarithmic;
  OrderStatistic statistic = OrderStatistic::iqm();  // of the differences
  double smallest_relevant = 0;                      // in units of the differences, >= 0; state it before measuring
  double confidence = kConfidence;
};

struct PairedComparison {
  std::size_t missing = 0;  // instances that one of the two lacks
  Band difference;          // first minus second: negative is for the first
  SignedRank test;
  // Share of instances on which the first is better, draws counting half, with Wilson's interval: the probability of
  // improvement of rliable (Agarwal et al. 2021) when every instance is a task with one run of either.
  Band probability_of_improvement;
  Verdict verdict = Verdict::undecided;
};

// Throws Error (internal) for columns that have not resampling.instances() values, (bad_input) for a negative or
// missing smallest relevant difference.
PairedComparison compare_paired(const std::vector<double>& first, const std::vector<double>& second,
                                const Resampling& resampling, const PairedOptions& options = {});

}  // namespace relign::statistics
