// The search on one target, free of the conversation: told values, it names the next place and the best one.
#pragma once

#include <relign/random.hpp>

#include "source_data.hpp"
#include "surrogates/likelihood.hpp"

namespace transfer_gp {

struct SearchSetup {
  Shape shape = Shape::rbf;
  Stacking stacking = Stacking::exact;
  double kappa = 3;
  std::size_t candidates = 4000;  // of a search without sources
};

// Space-filling: one sample in every slice of every axis.
Matrix latin_hypercube(relign::Random& random, std::size_t dimensions, std::size_t count);

class Search {
 public:
  // data: finished, or without sources, when this is a plain Gaussian process.
  Search(SourceData data, const SearchSetup& setup, std::uint64_t seed);

  void tell(const Vector& unit, double merit);
  Vector ask();
  Vector best();  // lowest posterior mean

 private:
  void refit();
  double standardised(double merit) const;
  // Random places around the best so far, closer from round to round.
  template <class Cost>
  Vector zoom(Vector at, double cost, int rounds, Eigen::Index count, const Cost& costs);

  SearchSetup setup_;
  SourceModel sources_;
  Scale scale_;
  Candidates candidates_;
  TargetModel target_;
  Vector centre_;  // of the prior of theta
  Vector theta_;
  std::vector<double> merits_;  // as told
  Predictions predictions_;     // of the candidates
  relign::Random random_;
};

}  // namespace transfer_gp
