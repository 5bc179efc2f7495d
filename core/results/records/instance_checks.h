// What the trials of one instance share, whatever method made them: their start, the instance's own optimum, and which
// optional scores its scene and noise level have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

class InstanceChecks {
 public:
  // `several_processors`: they may give other digits, so that the poses of searches are not compared. `several_terms`:
  // suites or builds of the program that may ask for other scores.
  InstanceChecks(bool several_processors, bool several_terms)
      : several_processors_(several_processors), several_terms_(several_terms) {}

  // A trial with a simulated stage. Returns what contradicts the trials before it, as the end of a sentence about the
  // trial; empty: nothing.
  std::string add(const TrialRecord& closing, const std::vector<StepNumbers>& steps);
  // After the trials: sentences without full stop.
  std::vector<std::string> findings() const;

 private:
  struct Start {
    std::string trial;
    std::vector<double> true_pose;  // commanded poses are in the coordinates of a trial
    double measured = kUnknown, mse = kUnknown;
  };
  struct Optimum {
    std::string trial;
    double mse = kUnknown;
    std::vector<double> pose;
  };
  // Trials with and without a score: their number, and one of them.
  struct Presence {
    std::size_t with = 0, without = 0;
    std::string one_with, one_without;
    std::set<std::string> methods_with, methods;
  };
  // The largest standard error of a trial, and which it is.
  struct Uncertainty {
    double error = 0;
    std::string trial;
  };
  using Lens = std::tuple<std::string, std::string, std::string, std::uint64_t>;  // scene, level, protocol, instance

  std::string check_start(const TrialRecord& closing, const StepNumbers& first);
  std::string check_optimum(const TrialRecord& closing);
  void count_scores(const TrialRecord& closing);

  bool several_processors_, several_terms_;
  std::map<std::pair<std::string, std::string>, std::vector<Uncertainty>> errors_;  // by scene and noise level
  std::map<Lens, Start> starts_;
  std::map<Lens, Optimum> optima_;                                              // under any protocol: ""
  std::map<std::tuple<std::string, std::string, std::string>, Presence> all_;   // by scene, noise level and column
  std::map<std::tuple<std::string, std::string, std::string>, Presence> some_;  // of scores that may be unknown
};

}  // namespace relign::records
