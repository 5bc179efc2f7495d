// Three or more algorithms on the same instances: Friedman's test for any difference, Holm's correction for the
// pairwise Wilcoxon tests.
//
// Pairs are tested on their own differences and not by mean ranks, so that the result of a pair does not depend on the
// other algorithms (Benavoli, Corani, Mangili, JMLR 17 (2016)).
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/signed_rank.h"

namespace relign::statistics {

struct Friedman {
  std::size_t instances = 0;       // with a value of every algorithm
  std::size_t left_out = 0;        // the others
  std::vector<double> mean_ranks;  // of each algorithm; 1 is lowest, ties share the mean rank
  // Friedman's chi squared, corrected for ties, with k - 1 degrees of freedom (scipy.stats.friedmanchisquare).
  double chi_squared = kMissing, p = kMissing;
  // F of Iman and Davenport (Communications in Statistics A9 (1980)) with k - 1 and (k - 1)(N - 1) degrees of freedom,
  // the better approximation (Demsar, JMLR 7 (2006)): report f_p. Infinite if all instances have the same ranks.
  double f = kMissing, f_p = kMissing;
};

// columns: one per algorithm with one value per instance, infinite values included. If all algorithms tie on all
// instances, chi squared and F are 0 and p is 1. NaN for fewer than two algorithms or no instance; F also for one
// instance. Throws Error (internal) for columns of different lengths.
Friedman friedman(const std::vector<std::vector<double>>& columns);

// p values with Holm's correction for multiple testing (Scandinavian Journal of Statistics 6 (1979)), in the given
// order: controls the family-wise error rate. NaN stays NaN and is not counted.
std::vector<double> holm(const std::vector<double>& p);

}  // namespace relign::statistics
