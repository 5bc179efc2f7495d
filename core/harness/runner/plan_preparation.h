// The pretraining of a plan's algorithms before the first trial, once for each scene, noise level and algorithm that
// needs it (preparation.h).
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "runner/preparation.h"
#include "runner/run.h"

namespace relign::runner {

class PlanPreparation {
 public:
  // Pretrains the algorithm of one trial; throws Error as Preparer::prepare does.
  using Make = std::function<Preparer::Entries(const suites::PlannedTrial& trial)>;
  // Without `make`, pretraining runs in this process.
  PlanPreparation(const PreparedPlan& plan, Preparer::Options options, Make make = nullptr)
      : plan_(plan), preparer_(std::move(options)), make_(std::move(make)) {}

  // For the trials at these positions. Calls on_begin with the name of each algorithm before it starts. Returns early
  // once the run is stopped, because no trial will start then.
  void prepare(const std::vector<std::size_t>& places, const std::function<void(const std::string&)>& on_begin);

  // Null when the trial's algorithm has no pretraining.
  const Preparer::Entries* of(const suites::PlannedTrial& trial) const;

  // For manifest.json.
  Json to_json() const;

 private:
  using Group = std::tuple<std::size_t, std::size_t, std::size_t>;  // scene, level, algorithm
  const PreparedPlan& plan_;
  Preparer preparer_;
  Make make_;
  std::map<Group, Preparer::Entries> groups_;
};

}  // namespace relign::runner
