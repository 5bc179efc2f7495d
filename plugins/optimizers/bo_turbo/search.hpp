// TuRBO-1 in the unit cube with an ask-and-tell interface.
#pragma once

#include <relign/random.hpp>
#include <vector>

#include "adam_fit.hpp"
#include "trust_region.hpp"

namespace bo_turbo {

struct Setup {
  std::size_t initial_points = 0;  // 0: 2 x axes
  std::size_t candidates = 0;      // 0: 100 x axes, at most 5000
  std::size_t exact_points = 80;   // with more points in a region, hyperparameters are refitted at every tenth only
};

class Search {
 public:
  Search(std::size_t axes, const Setup& setup, std::uint64_t seed);

  // A point of the initial design, or the lowest of a joint draw at the region's candidates.
  Vector ask();
  // A non-finite merit counts as the worst one of the region, and as a failure.
  void tell(const Vector& point, double merit);

  const TrustRegion& region() const { return region_; }
  std::size_t restarts() const { return restarts_; }

 private:
  void restart();
  void fit(const Matrix& points, const Vector& standardised);

  std::size_t axes_;
  Setup setup_;
  relign::Random design_numbers_;
  relign::Random candidate_numbers_;
  relign::Random draws_;
  TrustRegion region_;
  std::vector<Vector> design_;  // points not yet asked for, taken from the end
  std::vector<Vector> points_;  // of the current region
  std::vector<double> merits_;
  bool asked_in_region_ = false;  // the last ask() chose a candidate, whose merit changes the region
  Fitted fitted_;
  std::size_t fitted_with_ = 0;  // number of points at the last fit
  std::size_t restarts_ = 0;
};

}  // namespace bo_turbo
