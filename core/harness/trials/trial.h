// One trial: an algorithm on an instance, step by step, with budget, clocks and both truths.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "plugin_host/objects.h"
#include "trials/instance.h"
#include "trials/protocol.h"
#include "trials/scene_facts.h"
#include "trials/stage.h"

namespace relign::trials {

struct Truth {
  double mse = 0;  // unbiased, signed
  double standard_error = 0;
};

enum class RecommendationSource { own, best_measured, current };
const char* recommendation_source_name(RecommendationSource source);

// Everything known of one step; NaN where nobody knows, as all truths on a station. Host seconds are kept apart (they
// differ from run to run).
struct Step {
  unsigned number = 0;
  std::vector<double> commanded_pose;  // as asked, in the trial's coordinates
  std::vector<double> true_pose;
  std::uint64_t limits_low = 0;
  std::uint64_t limits_high = 0;
  double measured_rmse = 0;              // of the capture against O*
  double merit = 0;                      // what the algorithm was (or would have been) shown
  double machine_seconds = 0;            // simulated clock after this capture
  std::vector<double> recommended_pose;  // commanded coordinates
  RecommendationSource recommendation_source = RecommendationSource::best_measured;
  double recommended_seconds = 0;  // machine time if one moved back to the recommendation now
  std::vector<double> recommended_true_pose;
  Truth commanded_truth;
  Truth recommended_truth;
  // host time of this step, seconds
  double algorithm_seconds = 0;   // between the answer before and this request
  double simulation_seconds = 0;  // capture
  double truth_seconds = 0;
};

enum class End {
  budget_spent,  // all steps were used
  finished,      // the algorithm returned before; its recommendation is carried forward
  failed,        // the plugin reported a failure; the steps made are kept as a censored record
  overspent,     // the algorithm went on asking for steps after the last
  stopped        // the run was asked to stop; the trial is not a result
};
const char* end_name(End end);  // "budget_spent", ...

struct PreparedData;
struct Preparing;

struct TrialSetup {
  plugin_host::MountedAssembly* assembly = nullptr;  // of the instance's elements; null on a station
  plugin_host::Scene* station = nullptr;             // the scene itself when it owns its stage
  relign_image reference{};
  const SceneFacts* scene = nullptr;
  const Instance* instance = nullptr;
  const plugin_host::Choice* algorithm = nullptr;
  plugin_host::Scene* design = nullptr;      // the scene, for the service "model"; null: not offered
  plugin_host::NoiseLevel* level = nullptr;  // for the service "prior"; null: not offered
  // For the service "prepared" (prepared_service.h). By Choice::identity; null: nothing.
  const std::map<std::string, PreparedData>* prepared = nullptr;
  Preparing* preparing = nullptr;  // not null: the algorithm is being prepared, no truth is asked for
  plugin_host::HostServices services;
  Protocol protocol = Protocol::paper;
  std::optional<Merit> merit;  // overrides the protocol's; a station allows rmse alone
  Limits limits = Limits::soft;
  unsigned budget = 50;  // steps after step 0
  std::uint64_t algorithm_seed = 0;
  MachineTime machine_time;
  double mtf_lp_per_mm = 0;                 // over 0: the lens's MTF is measured once the trial has ended
  const std::atomic<bool>* stop = nullptr;  // may be null; checked before every step and while a process is waited for
  // Called when an algorithm goes on asking even after it was told, again and again, that it failed: it will never
  // return. May end the process, or return and let it go on for ever. May be empty.
  std::function<void()> on_runaway;
  // Called with the record of each step and its capture (valid during the call) once the record is
  // complete: when the algorithm asks for the next step, or at the end, for until then it may still
  // recommend. Before on_step of step k no capture of step k + 1 is made. What it throws ends the trial
  // and leaves run_trial. May be empty.
  std::function<void(const Step&, const float* pixels)> on_step;
};

// What the algorithms of the trial get: setup.services, and the trial's own stop flag.
plugin_host::HostServices algorithm_services(const TrialSetup& setup);

struct TrialResult {
  std::vector<Step> steps;  // at least step 0, unless the scene failed
  End end = End::budget_spent;
  std::string message;                           // why it failed
  std::string outcome;                           // how a plugin's process broke off (PluginEnded); mostly empty
  std::vector<std::string> environment_changes;  // what the plugin left behind, a sentence each
  double seconds_after_last_step = 0;            // algorithm time, host
  // Noise-free, at the last recommendation before the glue shifts the lens; NaN where it does not.
  double uncured_mse = std::numeric_limits<double>::quiet_NaN();
  // Noise-free, of each step in order, where gluing at its commanded pose would leave the lens: what the rules "best"
  // and "current" (stats/rules.h) are scored by. Empty where the glue shifts nothing: then it is commanded_truth.
  std::vector<Truth> glued_truths;
  // At one pose, where the glue leaves the lens and before it shifts it.
  struct GluedMtf {
    std::optional<plugin_host::MountedAssembly::FieldMtf> glued, uncured;
  };
  // At the last recommendation, at the step of the lowest measured RMSE, and at the last step.
  GluedMtf mtf, best_mtf, current_mtf;
  double judging_seconds = 0;  // what these took, host
};

// Runs the trial in this thread. Throws Error only for failures of the scene or of ours, and
// plugin_refused when the algorithm's library cannot be used; an algorithm's failure is a result.
TrialResult run_trial(const TrialSetup& setup);

}  // namespace relign::trials
