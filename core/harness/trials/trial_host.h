// The host's side of one trial: answers an algorithm's requests (relign_trial), keeps budget,
// clocks and ground truth, and completes a record of every step.
//
// A step's record is completed when the algorithm asks for the next step, or when the trial ends: until then the
// algorithm may change its recommendation. Functions of the table may throw: plugin_host carries exceptions past
// the plugin's frames, and keeps the floating-point states of host and plugin apart.
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

#include "trials/field_merit.h"
#include "trials/protocol.h"
#include "trials/services.h"
#include "trials/stage.h"
#include "trials/trial.h"
#include "trials/trial_view.h"

namespace relign::trials {

// Size of relign_observation in interface version 0.1.
constexpr std::size_t kMinObservationSize = offsetof(relign_observation, machine_seconds) + sizeof(double);

class TrialHost final : public TrialView {
 public:
  // Takes the capture of step 0. `setup` must outlive this object. Throws Error when the scene fails.
  TrialHost(const TrialSetup& setup, Rules rules);
  TrialHost(const TrialHost&) = delete;
  TrialHost& operator=(const TrialHost&) = delete;

  // Give the table to the algorithm between the two calls below. The time between them, minus that of our answers, is
  // the algorithm's.
  const relign_trial& table() const override { return table_; }
  void algorithm_starts() { left_host_ = Clock::now(); }
  void algorithm_ended();

  // Completes the record of the last step. Rethrows what the scene or on_step threw during the trial.
  void close();

  std::vector<Step> take_steps() { return std::move(steps_); }
  // TrialResult::scores without MTF. Call it before take_steps: a pose is scored once, and a recommended pose keeps the
  // estimate of its own step.
  records::Scores scores();
  // True pose of the lens, if it were fixed after the last step by the rule; `before` is empty where curing shifts
  // nothing.
  records::ByCuring<std::vector<double>> last_pose(records::Rule rule) const;
  double seconds_after_last_step() const { return algorithm_seconds_; }
  bool host_failed() const { return host_failure_ != nullptr; }
  bool was_stopped() const { return stopped_; }  // by the stop flag of TrialSetup::services
  // Reads the stop flag. The caller must refuse its request when this is true: the trial then ends as `stopped`.
  bool stop_requested() {
    stopped_ = stopped_ || (setup_->services.stop && setup_->services.stop->load());
    return stopped_;
  }
  bool budget_is_spent() const { return pending_.step >= setup_->terms.budget; }
  const std::string& refusal() const { return refusal_; }  // why the host gave up answering; usually empty

  // For the services and for algorithms that the trial's algorithm runs.
  const TrialSetup& setup() const { return *setup_; }
  Stage& stage() const { return *stage_; }
  const Step& last_step() const { return pending_; }  // before its recommendation and scores are known
  const plugin_host::Choice& algorithm() const override { return setup_->algorithm; }
  unsigned steps_left() const override { return setup_->terms.budget - pending_.step; }
  void write_observation(relign_observation* observation) const override;
  const relign_image& reference_image() const { return reference_image_; }
  const relign_image& last_capture() const { return image_; }
  bool shows_all() const { return pending_.regions.empty(); }  // the last capture is a whole frame
  // The scene as the last capture shows it: its fields end where the regions do.
  const SceneFacts& shown_scene() const { return shows_all() ? setup_->scene : shown_scene_; }
  // Of the next capture; must be valid, and empty if the scene does not capture regions.
  void select_regions(PixelRegions regions) { next_regions_ = std::move(regions); }
  // Returns the old value.
  double set_largest_move(double largest) { return std::exchange(rules_.largest_move, largest); }
  // Counts a refused request. Returns `status`, but RELIGN_FAILED to an algorithm that never stops asking.
  relign_status refuse(relign_status status);

 private:
  using Clock = std::chrono::steady_clock;
  struct Answer;  // one call from the algorithm into the host

  static TrialHost& self(void* context) { return *static_cast<TrialHost*>(context); }
  static relign_status answer_first(void* context, relign_observation* observation);
  static relign_status answer_step(void* context, const double* pose, std::uint32_t axes,
                                   relign_observation* observation);
  static relign_status answer_move(void* context, const double* delta, std::uint32_t axes,
                                   relign_observation* observation);
  static relign_status answer_recommend(void* context, const double* pose, std::uint32_t axes);
  static const void* answer_service(void* context, relign_text id);

  relign_status request(const double* values, std::uint32_t axes, bool relative, relign_observation* observation);
  bool is_pose(const double* values, std::uint32_t axes) const;
  std::vector<double> within_largest_move(std::vector<double> commanded) const;
  void move_and_capture(const std::vector<double>& commanded);
  void capture();
  double score_regions();
  void close_step();
  void choose_recommendation();
  Truth truth_at(const std::vector<double>& true_pose, unsigned step, FrameStream stream);
  void describe_task();

  const TrialSetup* setup_;
  Rules rules_;
  std::unique_ptr<Stage> stage_;

  // The structs that the algorithm gets pointers to.
  std::string axes_json_, readings_json_;
  relign_task task_{};
  relign_trial table_{};
  relign_image image_{};
  relign_image reference_image_{};
  Services services_{*this, *this};

  std::vector<float> reference_;  // tightly packed
  std::optional<FieldMerit> field_merit_;
  SceneFacts shown_scene_;  // of a capture of regions
  PixelRegions next_regions_;
  std::vector<float> pixels_;  // of the pending step
  Step pending_;               // the last step, whose record is not yet complete
  std::vector<Step> steps_;    // complete
  std::optional<std::vector<double>> own_recommendation_;
  std::vector<double> best_measured_pose_;
  double best_merit_ = 0;
  std::vector<double> lowest_measured_pose_;  // by RMSE, while best_measured_pose_ is by merit
  double lowest_measured_ = 0;
  // Moves back to the pose of the lowest measured RMSE, after each step; empty where each commanded pose has one true
  // pose.
  std::vector<Stage::VirtualMove> best_moves_;
  std::vector<double> uncured_true_pose_;        // at the last recommendation, see Stage::VirtualMove
  std::map<std::vector<double>, Truth> truths_;  // by true pose

  Clock::time_point left_host_;
  double algorithm_seconds_ = 0;  // since the last step
  bool stopped_ = false;
  std::uint64_t refused_ = 0;  // number of refused requests
  std::string refusal_;
  std::exception_ptr host_failure_;  // of the scene or of on_step; ends the trial
  std::thread::id thread_;
};

}  // namespace relign::trials
