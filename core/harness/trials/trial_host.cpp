#include "trials/trial_host.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/seeds.h"
#include "base/text.h"
#include "plugin_host/packed.h"
#include "trials/task_text.h"

namespace relign::trials {
namespace {

// After so many refused requests the host concludes that the algorithm will never return by itself.
constexpr std::uint64_t kMaxRefusals = 100'000;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of an image without padding.
images::View view_of(const relign_image& image) { return {image.pixels, image.width, image.height}; }

// "a non-finite reading 'loss'"
std::string non_finite_values(const SceneFacts& scene, const std::vector<float>& values) {
  const std::size_t first = std::size_t{scene.image_width} * (scene.image_height - 1);
  for (std::size_t i = 0; i < scene.readings.size(); ++i)
    if (!std::isfinite(values[first + i])) return "a non-finite reading " + in_quotes(scene.readings[i].name);
  return "non-finite pixels";
}

}  // namespace

// Stops the algorithm's clock for the time of one answer.
struct TrialHost::Answer {
  explicit Answer(TrialHost& trial) : host(trial) { host.algorithm_seconds_ += seconds_since(host.left_host_); }
  ~Answer() { host.left_host_ = Clock::now(); }
  Answer(const Answer&) = delete;
  Answer& operator=(const Answer&) = delete;

  TrialHost& host;
};

TrialHost::TrialHost(const TrialSetup& setup, Rules rules)
    : setup_(&setup),
      rules_(std::move(rules)),
      stage_(make_stage(setup, rules_)),
      reference_(plugin_host::packed(setup.reference)),
      pixels_(reference_.size()),
      best_merit_(std::numeric_limits<double>::infinity()),
      lowest_measured_(std::numeric_limits<double>::infinity()),
      left_host_(Clock::now()),
      thread_(std::this_thread::get_id()) {
  describe_task();
  if (needs_fields(rules_.merit))
    field_merit_.emplace(rules_.merit, setup.terms.mtf_limits, setup.scene, view_of(reference_image_));
  Stage::Arrival start = stage_->start();
  pending_.commanded_pose = std::move(start.commanded_pose);
  pending_.true_pose = std::move(start.true_pose);
  capture();
}

void TrialHost::describe_task() {
  const SceneFacts& scene = setup_->scene;
  axes_json_ = axes_text(scene);
  const bool sees_images = rules_.observes & RELIGN_OBSERVES_IMAGES;
  readings_json_ = sees_images ? readings_text(scene) : "[]";
  const bool has_box = rules_.observes & RELIGN_OBSERVES_BOX;

  task_.struct_size = sizeof task_;
  task_.axes = static_cast<std::uint32_t>(scene.axes.size());
  task_.budget = setup_->terms.budget;
  task_.observes = rules_.observes;
  task_.seed = setup_->terms.algorithm_seed;
  task_.box_lower = has_box ? rules_.box_lower.data() : nullptr;
  task_.box_upper = has_box ? rules_.box_upper.data() : nullptr;
  task_.largest_move = rules_.largest_move;
  task_.image_width = sees_images ? scene.image_width : 0;
  task_.image_height = sees_images ? scene.image_height : 0;
  task_.axes_json = {axes_json_.data(), axes_json_.size()};
  task_.readings_json = {readings_json_.data(), readings_json_.size()};

  image_.struct_size = sizeof image_;
  image_.sample_format = RELIGN_SAMPLE_FLOAT32;
  image_.width = scene.image_width;
  image_.height = scene.image_height;
  image_.channels = 1;
  image_.pixels = pixels_.data();
  image_.row_stride_bytes = scene.image_width * sizeof(float);

  reference_image_ = image_;
  reference_image_.pixels = reference_.data();

  table_.struct_size = sizeof table_;
  table_.context = this;
  table_.task = &task_;
  table_.first = answer_first;
  table_.step = answer_step;
  table_.move = answer_move;
  table_.recommend = answer_recommend;
  table_.get_service = answer_service;
  table_.why = [](void* context, const relign_text_sink* reason) { return self(context).services_.why(reason); };
}

// ---- functions that the algorithm calls -------------------------------------------------------

relign_status TrialHost::answer_first(void* context, relign_observation* observation) {
  TrialHost& host = self(context);
  const Answer answer(host);
  if (!observation || observation->struct_size < kMinObservationSize || host.pending_.step != 0)
    return host.refuse(RELIGN_BAD_ARGUMENT);
  host.write_observation(observation);
  return RELIGN_OK;
}

relign_status TrialHost::answer_step(void* context, const double* pose, std::uint32_t axes,
                                     relign_observation* observation) {
  return self(context).request(pose, axes, false, observation);
}

relign_status TrialHost::answer_move(void* context, const double* delta, std::uint32_t axes,
                                     relign_observation* observation) {
  return self(context).request(delta, axes, true, observation);
}

relign_status TrialHost::answer_recommend(void* context, const double* pose, std::uint32_t axes) {
  TrialHost& host = self(context);
  const Answer answer(host);
  if (!host.is_pose(pose, axes)) return host.refuse(RELIGN_BAD_ARGUMENT);
  host.own_recommendation_.emplace(pose, pose + axes);
  return RELIGN_OK;
}

const void* TrialHost::answer_service(void* context, relign_text id) {
  return id.data ? self(context).services_.get({id.data, static_cast<std::size_t>(id.size)}) : nullptr;
}

relign_status TrialHost::request(const double* values, std::uint32_t axes, bool relative,
                                 relign_observation* observation) {
  if (std::this_thread::get_id() != thread_) return RELIGN_BAD_ARGUMENT;
  const Answer answer(*this);
  if (budget_is_spent()) return refuse(RELIGN_STOP);
  if (stop_requested()) return refuse(RELIGN_STOP);
  if (!observation || observation->struct_size < kMinObservationSize || !is_pose(values, axes))
    return refuse(RELIGN_BAD_ARGUMENT);
  try {
    std::vector<double> commanded(values, values + axes);
    if (relative)
      for (std::size_t i = 0; i < commanded.size(); ++i) commanded[i] += stage_->reached_pose()[i];
    close_step();
    move_and_capture(within_largest_move(std::move(commanded)));
    write_observation(observation);
    return RELIGN_OK;
  } catch (...) {
    // Marks a failure of the scene or of on_step, which close() rethrows, unlike one of the algorithm.
    host_failure_ = std::current_exception();
    throw;
  }
}

relign_status TrialHost::refuse(relign_status status) {
  if (++refused_ < kMaxRefusals) return status;
  if (refused_ == 2 * kMaxRefusals && setup_->callbacks.on_runaway) setup_->callbacks.on_runaway();
  if (refusal_.empty())
    refusal_ = "made " + std::to_string(kMaxRefusals) + " requests that had to be refused (" +
               (status == RELIGN_STOP ? "steps beyond the end of the trial)" : "bad arguments)");
  return RELIGN_FAILED;
}

bool TrialHost::is_pose(const double* values, std::uint32_t axes) const {
  return values && axes == task_.axes && std::all_of(values, values + axes, [](double v) { return std::isfinite(v); });
}

void TrialHost::write_observation(relign_observation* observation) const {
  relign_observation all{};
  all.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(observation->struct_size, sizeof all));
  all.step = pending_.step;
  all.pose = pending_.commanded_pose.data();
  all.merit = rules_.observes & RELIGN_OBSERVES_MERIT ? pending_.merit : std::numeric_limits<double>::quiet_NaN();
  all.limits_low = pending_.limits_low;
  all.limits_high = pending_.limits_high;
  all.image = rules_.observes & RELIGN_OBSERVES_IMAGES ? &image_ : nullptr;
  all.machine_seconds = pending_.machine_seconds;
  std::memcpy(observation, &all, all.struct_size);
}

// ---- one step ---------------------------------------------------------------------------------

std::vector<double> TrialHost::within_largest_move(std::vector<double> commanded) const {
  const std::vector<double>& here = stage_->reached_pose();
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    const double move = commanded[i] - here[i];
    if (std::fabs(move) > rules_.largest_move) commanded[i] = here[i] + std::copysign(rules_.largest_move, move);
  }
  return commanded;
}

void TrialHost::move_and_capture(const std::vector<double>& commanded) {
  Stage::Arrival arrival = stage_->step_to(commanded);
  Step step;
  step.step = pending_.step + 1;
  step.commanded_pose = std::move(arrival.commanded_pose);
  step.true_pose = std::move(arrival.true_pose);
  step.limits_low = arrival.limits_low;
  step.limits_high = arrival.limits_high;
  step.machine_seconds = pending_.machine_seconds + arrival.machine_seconds;
  step.algorithm_seconds = std::exchange(algorithm_seconds_, 0.0);
  pending_ = std::move(step);
  capture();
}

// Takes the capture of the pending step, and its score and time.
void TrialHost::capture() {
  const auto start = Clock::now();
  pending_.regions = std::exchange(next_regions_, {});
  const bool whole = pending_.regions.empty();
  pending_.machine_seconds += stage_->capture(pending_.step, pending_.regions, pixels_.data());
  pending_.simulation_seconds = seconds_since(start);
  const double measured = whole ? setup_->scene.measured(pixels_.data(), reference_.data()) : score_regions();
  if (!std::isfinite(measured))
    throw Error(ErrorKind::plugin_failed, "scene '" + setup_->scene.name + "': the capture of step " +
                                              std::to_string(pending_.step) + " has " +
                                              non_finite_values(setup_->scene, pixels_));
  pending_.measured = whole ? measured : std::numeric_limits<double>::quiet_NaN();
  pending_.merit = measured;
  if (rules_.merit == Merit::combined)
    pending_.merit = combined_merit(measured, pending_.true_pose, setup_->scene.nominal_pose);
  else if (field_merit_)
    pending_.merit = field_merit_->of(view_of(image_), shown_scene().fields);
  if (!whole) return;  // regions are not comparable with other regions
  if (pending_.merit < best_merit_) {
    best_merit_ = pending_.merit;
    best_measured_pose_ = pending_.commanded_pose;
  }
  if (pending_.measured < lowest_measured_) {
    lowest_measured_ = pending_.measured;
    lowest_measured_pose_ = pending_.commanded_pose;
  }
}

// Of a capture of regions: sets the other pixels to 0, and returns the RMSE of the regions' pixels.
double TrialHost::score_regions() {
  double sum = 0;
  std::size_t end = 0, count = 0;
  for (const PixelSpan& span : spans_of(pending_.regions, image_.width)) {
    std::fill(pixels_.begin() + static_cast<std::ptrdiff_t>(end),
              pixels_.begin() + static_cast<std::ptrdiff_t>(span.first), 0.0F);
    end = span.first + span.count;
    for (std::size_t i = span.first; i < end; ++i) {
      const double difference = static_cast<double>(pixels_[i]) - static_cast<double>(reference_[i]);
      sum += difference * difference;
    }
    count += span.count;
  }
  std::fill(pixels_.begin() + static_cast<std::ptrdiff_t>(end), pixels_.end(), 0.0F);
  if (shown_scene_.axes.empty()) shown_scene_ = setup_->scene;
  show_regions(pending_.regions, setup_->scene.fields, shown_scene_.fields);
  return std::sqrt(sum / static_cast<double>(count));
}

// ---- the record of a step ---------------------------------------------------------------------

void TrialHost::close_step() {
  const auto start = Clock::now();
  choose_recommendation();
  const Stage::VirtualMove move = stage_->would_reach(pending_.recommended_pose);
  pending_.recommended_true_pose = move.true_pose;
  pending_.recommended_seconds = pending_.machine_seconds + move.machine_seconds;
  const Truth commanded = truth_at(pending_.true_pose, pending_.step, FrameStream::truth_commanded);
  const Truth recommended = truth_at(move.true_pose, pending_.step, FrameStream::truth_recommended);
  pending_.commanded_mse = commanded.mse;
  pending_.commanded_mse_error = commanded.standard_error;
  pending_.recommended_mse = recommended.mse;
  pending_.recommended_mse_error = recommended.standard_error;
  uncured_true_pose_ = move.uncured_true_pose;
  if (setup_->instance.perturbations.stage) best_moves_.push_back(stage_->would_reach(lowest_measured_pose_));
  pending_.truth_seconds = seconds_since(start);
  steps_.push_back(pending_);
  if (setup_->callbacks.on_step) setup_->callbacks.on_step(pending_, pixels_.data());
}

void TrialHost::choose_recommendation() {
  if (own_recommendation_) {
    pending_.recommendation = "own";
    pending_.recommended_pose = *own_recommendation_;
  } else if (rules_.recommend_current) {
    pending_.recommendation = "current";
    pending_.recommended_pose = pending_.commanded_pose;
  } else {
    pending_.recommendation = "best_measured";
    pending_.recommended_pose = best_measured_pose_;
  }
}

// Evaluates each true pose once: an unchanged recommendation costs nothing and keeps its value.
Truth TrialHost::truth_at(const std::vector<double>& true_pose, unsigned step, FrameStream stream) {
  const std::uint64_t seed = frame_seed(setup_->instance.seed, step, stream);
  if (!setup_->scoring()) return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  if (!stage_->has_ground_truth()) return stage_->truth_at(true_pose, seed);
  if (const auto known = truths_.find(true_pose); known != truths_.end()) return known->second;
  return truths_[true_pose] = stage_->truth_at(true_pose, seed);
}

records::Scores TrialHost::scores() {
  using records::Rule;
  records::Scores scores;
  const bool known = setup_->scoring() && stage_->has_ground_truth();
  const auto truth = [this](const std::vector<double>& pose, unsigned step) {
    return truth_at(pose, step, FrameStream::truth_recommended);
  };
  const auto add = [](const Truth& one, records::StepErrors& errors) {
    errors.mse.push_back(one.mse);
    errors.error.push_back(one.standard_error);
  };
  if (!uncured_true_pose_.empty()) {
    scores.uncured_mse[Rule::own] = truth(uncured_true_pose_, pending_.step).mse;
    for (const Step& step : steps_)
      if (known) add(truth(stage_->cured(step.true_pose), step.step), scores.by_step[Rule::current]);
  }
  for (std::size_t i = 0; known && i < best_moves_.size(); ++i)
    add(truth(best_moves_[i].true_pose, steps_[i].step), scores.by_step[Rule::best]);
  if (!best_moves_.empty() && !best_moves_.back().uncured_true_pose.empty())
    scores.uncured_mse[Rule::best] = truth(best_moves_.back().uncured_true_pose, pending_.step).mse;
  return scores;
}

records::ByCuring<std::vector<double>> TrialHost::last_pose(records::Rule rule) const {
  if (rule == records::Rule::own) return {{steps_.back().recommended_true_pose, uncured_true_pose_}};
  if (rule == records::Rule::best && !best_moves_.empty())
    return {{best_moves_.back().true_pose, best_moves_.back().uncured_true_pose}};
  const Step* at = &steps_.back();
  if (rule == records::Rule::best) {
    at = &steps_.front();
    for (const Step& step : steps_)
      if (step.measured < at->measured) at = &step;
  }
  return {{stage_->cured(at->true_pose), uncured_true_pose_.empty() ? std::vector<double>() : at->true_pose}};
}

void TrialHost::algorithm_ended() { algorithm_seconds_ += seconds_since(left_host_); }

void TrialHost::close() {
  if (host_failure_) std::rethrow_exception(host_failure_);
  close_step();
}

}  // namespace relign::trials
