// The conversation of an algorithm that another algorithm runs: the outer one's moves and captures, within a share of
// its budget, with no more than both may know, in coordinates of its own.
//
// Stage, budget, clocks and records stay with the trial. What is recommended here stays here.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trials/seat.h"
#include "trials/services.h"

namespace relign::trials {

class Conversation;

class NestedConversation final : public Seat {
 public:
  // `outer` stays where it is. largest_move: the inner algorithm's own rule.
  NestedConversation(Conversation& host, Seat& outer, const plugin_host::Choice& inner, unsigned budget,
                     std::uint64_t seed, double largest_move);

  const relign_conversation& table() const override { return table_; }
  const plugin_host::Choice& algorithm() const override { return *inner_; }
  unsigned steps_left() const override { return task_.budget - steps_; }
  void tell(relign_observation* seen) const override;

  unsigned steps() const { return steps_; }
  bool told_to_stop() const { return told_to_stop_; }
  // In the outer one's coordinates.
  const std::optional<std::vector<double>>& recommendation() const { return recommendation_; }
  // The lowest merit that the outer one was shown meanwhile, its pose and all but its image.
  const relign_observation& best() const { return best_; }
  const std::vector<double>& best_pose() const { return best_pose_; }

 private:
  static NestedConversation& self(void* context) { return *static_cast<NestedConversation*>(context); }
  relign_status request(const double* values, std::uint32_t axes, bool relative, relign_observation* seen);
  relign_status recommend(const double* pose, std::uint32_t axes);
  void look();  // takes over the outer one's last observation
  void describe_task(std::uint64_t seed, unsigned budget, double largest_move);

  Conversation* host_;
  Seat* outer_;
  const plugin_host::Choice* inner_;
  std::vector<double> origin_;  // of these coordinates, in the outer one's
  std::vector<double> box_lower_, box_upper_;
  relign_task task_{};
  relign_conversation table_{};
  relign_observation seen_{};  // as told to the inner one
  std::vector<double> pose_;
  relign_observation best_{};  // as told to the outer one
  std::vector<double> best_pose_;
  unsigned steps_ = 0;
  bool told_to_stop_ = false;
  std::optional<std::vector<double>> recommendation_;
  Services services_;  // its own, for the inner one
};

}  // namespace relign::trials
