// Bayesian optimisation of one target with an ask-and-tell interface.
#pragma once

#include <relign/random.hpp>

#include "source_data.hpp"
#include "surrogates/likelihood.hpp"

namespace transfer_gp {

struct SearchSetup {
  Shape shape = Shape::rbf;
  Stacking stacking = Stacking::exact;
  double kappa = 3;
  std::size_t candidates = 4000;  // number, for a search without sources
};

class Search {
 public:
  // data: finished, or without sources (a Gaussian process without a learnt prior).
  Search(SourceData data, const SearchSetup& setup, std::uint64_t seed);

  void tell(const Vector& unit, double merit);
  Vector ask();
  Vector best();  // lowest posterior mean

 private:
  void refit();
  double standardised(double merit) const;
  // Local random search around `at` with decreasing radius.
  template <class Cost>
  Vector zoom(Vector at, double cost, int rounds, Eigen::Index count, const Cost& costs);

  SearchSetup setup_;
  SourceModel sources_;
  Scale scale_;
  Candidates candidates_;
  TargetModel target_;
  Vector centre_;  // mean of the prior of theta
  Vector theta_;
  std::vector<double> merits_;  // not scaled
  Predictions predictions_;     // at the candidates
  relign::Random random_;
};

}  // namespace transfer_gp
