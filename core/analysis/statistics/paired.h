// Paired comparison of two algorithms on the same instances: effect size, interval, test and verdict.
//
// Computed from the differences per instance, first minus second, so that the difficulty of an instance cancels. Lower
// values are better: scores, steps to a target.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"
#include "statistics/order_statistic.h"
#include "statistics/resampling.h"
#include "statistics/signed_rank.h"

namespace relign::statistics {

// logarithmic: differences of natural logarithms, whose exp() is a ratio: log(1.05) is "5 % worse". For RMSE, which
// differs between instances by factors.
enum class Scale { raw, logarithmic };

// One per instance: NaN if either value is NaN, 0 if both are equal, also if both are infinite (target not reached).
// Throws Error (internal) for columns of different lengths, (bad_input) for the logarithm of a negative value.
std::vector<double> paired_differences(const std::vector<double>& first, const std::vector<double>& second,
                                       Scale scale);

// Verdict from the interval of the difference and the smallest relevant difference d (equivalence testing):
//   better: entirely below -d      worse: entirely above d      practically equal: entirely within [-d, d]
// Otherwise, and without an interval, undecided: more instances are needed.
enum class Verdict { better, worse, practically_equal, undecided };
const char* verdict_name(Verdict verdict);  // "practically equal"
Verdict verdict_of(const Interval& difference, double smallest_relevant);

struct PairedOptions {
  Scale scale = Scale::logarithmic;
  OrderStatistic statistic = OrderStatistic::iqm();  // of the differences
  double smallest_relevant = 0;                      // in units of the differences, >= 0; choose it before measuring
  double confidence = kConfidence;
};

struct PairedComparison {
  std::size_t missing = 0;  // instances without a value of both
  Band difference;          // first minus second: negative if the first is better
  SignedRank test;
  // Share of instances on which the first is better, ties counting half, with Wilson's interval: rliable's probability
  // of improvement (Agarwal et al. 2021) with each instance as a task with one run.
  Band probability_of_improvement;
  Verdict verdict = Verdict::undecided;
};

// Throws Error: internal for columns whose size is not resampling.instances(), bad_input for a smallest relevant
// difference that is negative or NaN.
PairedComparison compare_paired(const std::vector<double>& first, const std::vector<double>& second,
                                const Resampling& resampling, const PairedOptions& options = {});

}  // namespace relign::statistics
