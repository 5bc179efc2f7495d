// The trial of an inner algorithm that an outer algorithm runs: it forwards requests to the outer trial within a part
// of its budget, in coordinates of its own, and shows what both algorithms may observe.
//
// Stage, budget, clocks and records are those of the outer trial. A recommendation of the inner algorithm is only
// reported to the outer one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trials/services.h"
#include "trials/trial_view.h"

namespace relign::trials {

class TrialHost;

class NestedTrial final : public TrialView {
 public:
  // `outer` must outlive this object. largest_move: the limit of the inner algorithm.
  NestedTrial(TrialHost& host, TrialView& outer, const plugin_host::Choice& inner, unsigned budget, std::uint64_t seed,
              double largest_move);

  const relign_trial& table() const override { return table_; }
  const plugin_host::Choice& algorithm() const override { return *inner_; }
  unsigned steps_left() const override { return task_.budget - steps_; }
  void write_observation(relign_observation* observation) const override;

  unsigned steps() const { return steps_; }
  bool stopped() const { return stopped_; }  // a request was answered with RELIGN_STOP
  // In the outer algorithm's coordinates.
  const std::optional<std::vector<double>>& recommendation() const { return recommendation_; }
  // The outer algorithm's observation of the lowest merit during the nested trial, and its pose. The image may be
  // overwritten since.
  const relign_observation& best() const { return best_; }
  const std::vector<double>& best_pose() const { return best_pose_; }

 private:
  static NestedTrial& self(void* context) { return *static_cast<NestedTrial*>(context); }
  relign_status request(const double* values, std::uint32_t axes, bool relative, relign_observation* observation);
  relign_status recommend(const double* pose, std::uint32_t axes);
  void take_outer_observation();
  void describe_task(std::uint64_t seed, unsigned budget, double largest_move);

  TrialHost* host_;
  TrialView* outer_;
  const plugin_host::Choice* inner_;
  std::vector<double> origin_;  // of the inner coordinates, in outer coordinates
  std::vector<double> box_lower_, box_upper_;
  relign_task task_{};
  relign_trial table_{};
  relign_observation observation_{};  // as the inner algorithm gets it
  std::vector<double> pose_;
  relign_observation best_{};  // as the outer algorithm gets it
  std::vector<double> best_pose_;
  unsigned steps_ = 0;
  bool stopped_ = false;
  std::optional<std::vector<double>> recommendation_;
  Services services_;  // of the inner algorithm
};

}  // namespace relign::trials
