// Three algorithms or more on the same instances: does any differ at all (Friedman), and which pairs do (Wilcoxon's
// test with Holm's correction)?
//
// Pairs are tested by their own differences, not by mean ranks: whether two differ must not depend on which others were
// measured (Benavoli, Corani, Mangili, JMLR 17 (2016)). Mean ranks are for pictures.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/signed_rank.h"

namespace relign::statistics {

struct Friedman {
  std::size_t instances = 0;       // on which every algorithm has a value
  std::size_t left_out = 0;        // the others
  std::vector<double> mean_ranks;  // of each algorithm; 1 is best, that is lowest; ties share
  // Friedman's chi squared, corrected for ties, with k - 1 degrees of freedom (scipy.stats.friedmanchisquare).
  double chi_squared = kMissing, p = kMissing;
  // The better approximation of Iman and Davenport (Communications in Statistics A9 (1980)), see Demsar, JMLR 7
  // (2006): F with k - 1 and (k - 1)(N - 1) degrees of freedom; infinite when all instances rank alike. Report this p.
  double f = kMissing, f_p = kMissing;
};

// columns: one an algorithm, one value an instance; infinite ones count. If all algorithms tie everywhere, chi squared
// and F are 0 and p is 1. Fewer than two algorithms or no instance: everything is missing; one instance: F is.
// Throws Error (internal) for columns of different lengths.
Friedman friedman(const std::vector<std::vector<double>>& columns);

// p values corrected for their number (Holm, Scandinavian Journal of Statistics 6 (1979)), in their order. Rejecting
// those at or below 0.05 is wrong about any of them in at most 5 % of all studies. NaN stays and does not count.
std::vector<double> holm(const std::vector<double>& p);

}  // namespace relign::statistics
