// What a good module costs on a line, by the prices that a suite states ("cost", docs/suites.md).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/suite_terms.h"
#include "statistics/cycle.h"
#include "statistics/track_columns.h"

namespace relign::statistics {

// What one module costs on average that was begun on the line.
struct LineCost {
  double good = 0;      // good modules
  double scrapped = 0;  // modules
  double seconds = 0;   // of the station
  double price = 0;     // station, rework and scrap

  double good_per_hour() const { return 3600 * good / seconds; }
  double per_good_module() const { return price / good; }  // infinite without any
};
// A share `met` of the modules meets the specification after `seconds` of the station. The others are scrapped, or with
// a price of rework aligned once more first, with the same share of success and the same time (an assumption).
LineCost line_cost(const Prices& prices, double met, double seconds);

// A method on the line, aligning every module with the same number of images.
struct CostStudy {
  // Moves of the modules of the first and of the other half of the instances (every second one). Equal at the budget.
  std::array<unsigned, 2> steps = {};
  Band met, scrapped, seconds;  // share, share, mean station time of one alignment
  Band good_per_hour, per_good_module;
  Band saves;  // saving(): n is 0 without a baseline and for the baseline itself
};

// One method's instances with their outcome at each step.
class CostColumns {
 public:
  // `instances`: sorted. Does nothing unless prices are stated.
  CostColumns(const std::vector<std::uint64_t>& instances, const Prices& prices, const Cycle& cycle);

  // met: one per recorded step. A trial that ended early keeps its last step.
  void add(const ReadTrial& trial, const std::vector<bool>& met);
  // A trial that failed: its module misses, and its time counts as the mean of the others.
  void add_failed(std::uint64_t instance);

  struct Chosen {
    std::array<unsigned, 2> steps = {};
    std::vector<double> met, seconds;  // one per instance; met is NaN for instances without a trial
  };
  bool empty() const { return trials_.empty(); }
  unsigned last_step() const;
  Chosen at(std::array<unsigned, 2> steps) const;
  // The number of steps with the least cost of a good module on each half of the instances, for the other half, so that
  // no module takes part in choosing its own. Fewest steps of equal ones.
  Chosen cheapest() const;

 private:
  struct Trial {
    std::size_t place = 0;  // of the instance
    std::vector<char> met;  // empty: it failed
    std::vector<float> seconds;
  };
  unsigned cheapest_of(std::size_t half) const;

  const std::vector<std::uint64_t>& instances_;
  const Prices& prices_;
  Cycle cycle_;
  std::vector<Trial> trials_;
};

// Intervals: Wilson's of the share, Student's of the mean time, and for numbers of both the two combined by MOVER as if
// they were independent. A bootstrap would give no width to a share of 0 or 1.
CostStudy study_cost(const Prices& prices, const CostColumns::Chosen& chosen);

// What a good module costs less than with the baseline, combined by MOVER as if the two were independent: too wide
// where the methods meet the specification on the same instances. n is 0 if one of them has no good module.
Band saving(const CostStudy& study, const CostStudy& baseline);

}  // namespace relign::statistics
