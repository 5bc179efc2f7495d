// "relign.run/1": runs another algorithm for some steps of the caller's budget (hand-over).
#pragma once

#include <vector>

#include "trials/services.h"

namespace relign::trials {

class RunService {
 public:
  explicit RunService(ServiceContext& shared) : shared_(&shared) {}
  RunService(const RunService&) = delete;
  RunService& operator=(const RunService&) = delete;
  relign_status run_inner(const plugin_host::Choice& inner, std::uint32_t most_steps, relign_run_outcome& outcome);

 private:
  ServiceContext* shared_;
  std::uint64_t runs_ = 0;
  // What the last outcome points to.
  relign_observation last_{};
  relign_observation best_{};
  std::vector<double> best_pose_;
  std::vector<double> recommendation_;
};

}  // namespace relign::trials
