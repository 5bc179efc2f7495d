// Images and seconds to each criterion of a specification that is judged after every step, and to all of them. Used by
// study.cpp only.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "statistics/study.h"
#include "statistics/track_columns.h"

namespace relign::statistics {

// Whether the own recommendation of each step meets the whole specification. A limited MTF of centre and corners counts
// as it is at the end.
std::vector<bool> met_by_step(const TrialTable& table, const records::Specification& spec, const ReadTrial& trial);

class SpecArrivals {
 public:
  // Does nothing without such criteria.
  SpecArrivals(const TrialTable& table, const Series& series, const records::Specification& spec, const Cycle& cycle);

  // A criterion is reached at the first step whose recommendation meets it, all of them at the first step that meets
  // all at once; a limited MTF of centre and corners, which is known at the end only, must be met there.
  void add(const ReadTrial& trial);
  void finish(SeriesStudy& study) const;

 private:
  struct Arrival {
    explicit Arrival(std::string of) : name(std::move(of)) {}
    std::string name;
    std::size_t in_spec = 0;
    std::vector<TargetTime> steps, seconds, cycles;
  };
  struct AtStep {
    ByCriterion<std::vector<double>> values;
    std::size_t met = 0;
  };
  void arrive(Arrival& arrival, const std::vector<bool>& met, const ReadTrial& trial) const;

  const TrialTable& table_;
  const records::Specification& spec_;
  Cycle cycle_;
  std::size_t failed_;
  std::vector<Arrival> arrivals_;  // score and criteria as limited, then all; empty without criteria
  std::vector<AtStep> curve_;
};

}  // namespace relign::statistics
