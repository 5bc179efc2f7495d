// What the algorithms of a plan load: prepared before the first trial, one preparation for each scene, noise level and
// algorithm that needs it (preparation.h).
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
  // How one trial's algorithm is prepared; throws Error as Preparer::prepare does.
  using Make = std::function<Preparer::Entries(const suites::PlannedTrial& trial)>;
  // Without `make` they are prepared here, in this process.
  PlanPreparation(const PreparedPlan& plan, Preparer::Options options, Make make = nullptr)
      : plan_(plan), preparer_(std::move(options)), make_(std::move(make)) {}

  // Of the trials at these places. on_begin gets the name of each algorithm before it is looked at. Once the run is
  // asked to stop it returns early: no trial will begin either.
  void prepare(const std::vector<std::size_t>& places, const std::function<void(const std::string&)>& on_begin);

  // Null when the trial's algorithm loads nothing.
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
