// The pretraining of a plan's algorithms before the first trial, once for each scene, noise level and algorithm that
// needs it (pretraining.h).
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "runner/pretraining.h"
#include "runner/run.h"

namespace relign::runner {

class PlanPretraining {
 public:
  // Pretrains the algorithm of one trial; throws Error as Pretrainer::prepare does.
  using Make = std::function<Pretrainer::Entries(const suites::PlannedTrial& trial)>;
  // Without `make`, pretraining runs in this process.
  PlanPretraining(const PreparedPlan& plan, Pretrainer::Options options, Make make = nullptr)
      : plan_(plan), pretrainer_(std::move(options)), make_(std::move(make)) {}

  // For the trials at these positions. Calls on_begin with the name of each algorithm before it starts. Returns early
  // once the run is stopped, because no trial will start then.
  void prepare(const std::vector<std::size_t>& places, const std::function<void(const std::string&)>& on_begin);

  // Null when the trial's algorithm has no pretraining.
  const Pretrainer::Entries* of(const suites::PlannedTrial& trial) const;

  // For manifest.json.
  std::vector<records::Pretrained> recorded() const;

 private:
  using Group = std::tuple<std::size_t, std::size_t, std::size_t>;  // scene, level, algorithm
  const PreparedPlan& plan_;
  Pretrainer pretrainer_;
  Make make_;
  std::map<Group, Pretrainer::Entries> groups_;
};

}  // namespace relign::runner
