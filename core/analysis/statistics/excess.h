// Excess error: the noise-free score of a pose above that of the instance's own optimum, for the RMSE
// sqrt(max(0, MSE - MSE of the own optimum)), after given numbers of images and by each recommendation rule (rules.h).
#pragma once

#include <array>
#include <vector>

#include "statistics/quantiles.h"
#include "statistics/track_columns.h"

namespace relign::statistics {

// One value per step at the pose given by the rule; NaN where the scores or the own optimum are unknown. By Rule::own
// these are the values of Track::excess.
std::vector<double> excess_errors(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Rule rule,
                                  const SceneScore& score);

// Numbers of images after which the excess is reported: those of 6, 12 and 50 below `last`, and `last`. Image k is step
// k: the capture at the start, step 0, does not count.
std::vector<unsigned> excess_images(unsigned last);

struct ExcessScore {
  Quantiles values;   // over the instances
  Interval interval;  // of the median; NaN where not computed
};

struct ExcessAfter {
  unsigned images = 0;
  ByRule<ExcessScore> rules;
};

// The excess errors of a series, [image count of excess_images()][rule][trial]. A trial that ended early keeps its last
// step, as in curves.
class ExcessColumns {
 public:
  explicit ExcessColumns(const Series& series);
  void add(const ReadTrial& trial);

  const std::vector<unsigned>& images() const { return images_; }
  const std::vector<double>& at(std::size_t place, Rule rule) const { return values_[place][rule]; }
  bool any() const;  // some value is known

 private:
  std::vector<unsigned> images_;
  std::vector<ByRule<std::vector<double>>> values_;
};

}  // namespace relign::statistics
