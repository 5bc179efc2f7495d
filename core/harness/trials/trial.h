// One trial: an algorithm on an instance, step by step, with budget, clocks and ground truth.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "plugin_host/objects.h"
#include "records/record.h"
#include "trials/instance.h"
#include "trials/model_scene.h"
#include "trials/pretraining.h"
#include "trials/protocol.h"
#include "trials/scene_facts.h"
#include "trials/stage_motion.h"

namespace relign::trials {

struct Truth {
  double mse = 0;  // unbiased, signed
  double standard_error = 0;
};

// The complete record of one step; NaN where unknown, such as all ground truth on a station. Host seconds differ from
// run to run and are kept apart.
struct Step : records::StepRecord {
  double algorithm_seconds = 0;   // between the previous answer and this request
  double simulation_seconds = 0;  // capture
  double truth_seconds = 0;
};

enum class End {
  budget_spent,  // all steps were used
  finished,      // the algorithm returned earlier; its recommendation is carried forward
  failed,        // the plugin reported a failure; the steps so far are kept as a censored record
  overspent,     // the algorithm kept asking for steps after the last one
  stopped        // the run was stopped; the trial does not count
};
const char* end_name(End end);  // "budget_spent", ...

// A lens on the simulated stage. An algorithm may draw from the noise level (service "prior") and simulate with the
// design model (service "model").
struct SimulatedLens {
  plugin_host::MountedAssembly& assembly;  // of the instance's elements
  ModelScene& model;
  plugin_host::NoiseLevel& level;
};

// A scene that moves and captures by itself.
struct Station {
  plugin_host::Scene& scene;
};

using StageSetup = std::variant<SimulatedLens, Station>;

// What the suite decides for a trial.
struct Terms {
  Protocol protocol = Protocol::paper;
  std::optional<Merit> merit = {};  // overrides the protocol's; a station does not allow combined
  MtfLimits mtf_limits = {};        // of merit mtf
  Limits limits = Limits::soft;
  unsigned budget = 50;  // steps after step 0
  std::uint64_t algorithm_seed = 0;
  MachineTime machine_time = {};
};

// A benchmark trial: its steps are scored, if the scene has ground truth.
struct Scoring {
  double mtf_lp_per_mm = 0;  // above 0: measure the lens's MTF when the trial has ended
};

// A trial on a source instance that pretrains its algorithm, without ground truth.
struct Pretraining {
  PretrainingState& state;
};

using Purpose = std::variant<Scoring, Pretraining>;

// Functions that a trial calls; each may be empty.
struct Callbacks {
  // Called when an algorithm keeps asking although RELIGN_FAILED was returned many times: it will never return by
  // itself. May end the process, or return and let the algorithm continue.
  std::function<void()> on_runaway = {};
  // Called with the record of each step and its capture (valid during the call) once the record is complete: when the
  // algorithm asks for the next step, or at the end, because until then it may recommend. on_step of step k is called
  // before the capture of step k + 1. An exception from it ends the trial and propagates out of run_trial.
  std::function<void(const Step&, const float* pixels)> on_step = {};
};

struct TrialSetup {
  StageSetup stage;  // Station exactly if the scene owns its stage
  relign_image reference;
  const SceneFacts& scene;
  const Instance& instance;
  const plugin_host::Choice& algorithm;
  Terms terms = {};
  Purpose purpose = Scoring{};
  PreparedByIdentity prepared = {};  // pretrained data of the algorithm and of those that it runs
  // For the algorithm and those that it runs. `stop` ends the trial: it is checked before every step and while waiting
  // for a process.
  plugin_host::HostServices services = {};
  Callbacks callbacks = {};

  const Scoring* scoring() const { return std::get_if<Scoring>(&purpose); }  // null in pretraining
};

struct TrialResult {
  std::vector<Step> steps;  // at least step 0, unless the scene failed
  End end = End::budget_spent;
  std::string message;                           // the reason of a failure
  std::string outcome;                           // how a plugin's process ended (PluginEnded); usually empty
  std::vector<std::string> environment_changes;  // side effects that the plugin left in the process, a message each
  double seconds_after_last_step = 0;            // algorithm time, host
  records::Scores scores;                        // of a trial that was not stopped
  double judging_seconds = 0;                    // host time for the scores above
};

// The lens's MTF at a true pose; NaN if its scene does not offer it.
records::MtfRecord mtf_at(plugin_host::MountedAssembly& lens, const std::vector<double>& true_pose, double lp_per_mm);

// Runs the trial in this thread. Throws Error only for failures of the scene or the host, and
// plugin_rejected when the algorithm's library cannot be used; an algorithm's failure is part of the result.
TrialResult run_trial(const TrialSetup& setup);

}  // namespace relign::trials
