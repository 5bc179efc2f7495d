// The host's side of one trial: answers an algorithm's requests (relign_conversation), keeps budget,
// clocks and truths, and writes a record of every step.
//
// A step's record is written when the next step is asked for, or when the trial ends: until then the
// algorithm may still change its recommendation for it. Functions of the table may throw: the plugin
// host takes that to its own side of the plugin, and keeps floating-point states apart.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "trials/protocol.h"
#include "trials/rig.h"
#include "trials/seat.h"
#include "trials/services.h"
#include "trials/trial.h"

namespace relign::trials {

// The members that a writer of interface version 0.1 knows.
constexpr std::size_t kSmallestObservation = offsetof(relign_observation, machine_seconds) + sizeof(double);

class Conversation final : public Seat {
 public:
  // Makes the capture of step 0. `setup` must outlive this. Throws Error when the scene fails.
  Conversation(const TrialSetup& setup, Rules rules);
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  // Give the table to the algorithm between these two; time between them that is not spent in our
  // answers is the algorithm's.
  const relign_conversation& table() const override { return table_; }
  void algorithm_starts() { left_host_ = Clock::now(); }
  void algorithm_ended();

  // Writes the record of the last step. Throws what the scene or on_step threw during the trial.
  void close();

  std::vector<Step> take_steps() { return std::move(steps_); }
  // At the last recommendation before the glue cures; NaN where it shifts nothing.
  Truth uncured_truth();
  // Where gluing at the commanded pose of `step` would leave the lens.
  std::vector<double> glued_true_pose(const Step& step) const { return rig_->cured(step.true_pose); }
  // TrialResult::glued_truths. Last of all that is scored, so that a recommended pose keeps the estimate of its own
  // step.
  std::vector<Truth> glued_truths();
  double seconds_after_last_step() const { return algorithm_seconds_; }
  bool host_failed() const { return host_failure_ != nullptr; }
  bool was_stopped() const { return stopped_; }  // by TrialSetup::stop
  // Asks TrialSetup::stop. Whoever is told so must be refused: from then on the trial is no result.
  bool asked_to_stop() {
    stopped_ = stopped_ || (setup_->stop && setup_->stop->load());
    return stopped_;
  }
  bool budget_is_spent() const { return pending_.number >= setup_->budget; }
  // Where the last recommendation leaves the lens before the glue shifts it; empty where it does not.
  const std::vector<double>& uncured_true_pose() const { return uncured_true_pose_; }
  const std::string& refusal() const { return refusal_; }  // why the host gave up answering; mostly empty

  // For the services and for algorithms that the trial's algorithm runs.
  const TrialSetup& setup() const { return *setup_; }
  const plugin_host::Choice& algorithm() const override { return *setup_->algorithm; }
  unsigned steps_left() const override { return setup_->budget - pending_.number; }
  void tell(relign_observation* seen) const override;
  const relign_image& reference_image() const { return reference_image_; }
  const relign_image& last_capture() const { return image_; }
  double set_largest_move(double largest) { return std::exchange(rules_.largest_move, largest); }  // gives the old one
  // Counts a request that gets no step: whoever goes on asking for ever is told RELIGN_FAILED.
  relign_status refuse(relign_status status);

 private:
  using Clock = std::chrono::steady_clock;
  struct Answer;  // one call from the algorithm into the host

  static Conversation& self(void* context) { return *static_cast<Conversation*>(context); }
  static relign_status answer_first(void* context, relign_observation* seen);
  static relign_status answer_step(void* context, const double* pose, std::uint32_t axes, relign_observation* seen);
  static relign_status answer_move(void* context, const double* delta, std::uint32_t axes, relign_observation* seen);
  static relign_status answer_recommend(void* context, const double* pose, std::uint32_t axes);
  static const void* answer_service(void* context, relign_text id);

  relign_status request(const double* values, std::uint32_t axes, bool relative, relign_observation* seen);
  bool is_pose(const double* values, std::uint32_t axes) const;
  std::vector<double> within_largest_move(std::vector<double> commanded) const;
  void move_and_capture(const std::vector<double>& commanded);
  void capture();
  void close_step();
  void choose_recommendation();
  Truth truth_at(const std::vector<double>& true_pose, unsigned step, FrameStream stream);
  void describe_task();

  const TrialSetup* setup_;
  Rules rules_;
  std::unique_ptr<Rig> rig_;

  // What the algorithm is given.
  std::string axes_json_;
  relign_task task_{};
  relign_conversation table_{};
  relign_image image_{};
  relign_image reference_image_{};
  Services services_{*this, *this};

  std::vector<float> reference_;  // tightly packed
  std::vector<float> pixels_;     // of the pending step
  Step pending_;                  // made, its record not yet written
  std::vector<Step> steps_;       // written
  std::optional<std::vector<double>> own_recommendation_;
  std::vector<double> best_measured_pose_;
  double best_merit_ = 0;
  std::vector<double> uncured_true_pose_;        // of the last recommendation, see Rig::VirtualMove
  std::map<std::vector<double>, Truth> truths_;  // by true pose

  Clock::time_point left_host_;
  double algorithm_seconds_ = 0;  // since the last step was made
  bool stopped_ = false;
  std::uint64_t refused_ = 0;  // requests that got no step
  std::string refusal_;
  std::exception_ptr host_failure_;  // scene or on_step; ends the conversation
  std::thread::id thread_;
};

}  // namespace relign::trials
