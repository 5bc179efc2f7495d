// Runs single trials from plain data, and keeps what the next trial can use again: the scene, the noise
// level, the mounted lens. `run`, `try` and `verify` share this path; one per thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "plugin_host/objects.h"
#include "records/record.h"
#include "runner/run.h"
#include "runner/trial_log.h"
#include "trials/instance.h"
#include "trials/prepared_service.h"
#include "trials/trial.h"

namespace relign::runner {

// All that a worker needs for one trial.
struct TrialJob {
  std::string id;
  std::string scene_name, level_name, algorithm_name;  // shown
  std::string method, training;                        // of a list of trainings; else empty
  plugin_host::Choice scene, level, algorithm;
  trials::SceneFacts facts;
  trials::Protocol protocol = trials::Protocol::paper;
  trials::Merit merit = trials::Merit::combined;
  trials::Limits limits = trials::Limits::soft;
  trials::MachineTime machine_time;  // the suite's values over the scene's
  unsigned budget = 50;            // steps after step 0
  double mtf_lp_per_mm = 0;        // of the specification; 0: no MTF is asked for
  std::uint64_t suite_seed = 1;
  std::uint64_t instance = 0;
  std::shared_ptr<const trials::PreparedByIdentity> prepared = nullptr;  // what its algorithms load
  // Not null: `instance` is a source instance, on which the algorithm is prepared (preparation.h).
  trials::Preparing* preparing = nullptr;
};

// The record of a trial before its first step: names, numbers, budget.
records::TrialRecord begin_record(const TrialJob& job);
records::StepRecord to_record(const trials::Step& step);

TrialJob make_job(const PreparedPlan& prepared, const suites::PlannedTrial& trial);

struct TrialOutcome {
  records::TrialRecord record;
  records::TrialTimes times;  // plugin hashes not filled in
  std::string log;            // what its plugins printed and logged; empty: nothing
  double seconds = 0;         // from its first step to its end, host; harness_seconds of `times` is a part of it
  bool stopped = false;       // ended because it was asked to stop: the record is no result
};

class TrialRunner {
 public:
  struct Options {
    unsigned threads = 1;  // for the scene's own work
    std::filesystem::path cache_folder;
    std::function<void(const std::string&)> on_message;  // a plugin's warnings; any thread
    const std::atomic<bool>* stop = nullptr;             // for scenes and levels that are processes; may be null
    std::function<void(std::string_view)> on_log = {};   // each piece of a trial's log; may be empty
    std::function<void()> on_runaway = {};               // see trials::TrialSetup; may be empty
    // Once the lens is mounted, with what is known of the trial before its first step; may be empty.
    std::function<void(const records::TrialRecord&)> on_begin = {};
  };
  explicit TrialRunner(Options options);
  ~TrialRunner();
  TrialRunner(const TrialRunner&) = delete;
  TrialRunner& operator=(const TrialRunner&) = delete;

  // A failure of algorithm, noise level or scene is a record with end "failed" and the steps made until
  // then. Throws Error only for what concerns more than this trial (a library that cannot be loaded).
  using OnStep = std::function<void(const trials::Step&, const float* pixels)>;
  TrialOutcome run(const TrialJob& job, const std::atomic<bool>* stop = nullptr, const OnStep& on_step = {});

  // The job's lens in its scene. References are valid until the next run or place.
  struct Placed {
    const trials::Instance& instance;
    plugin_host::MountedAssembly* assembly;  // null on a station, which has its own lens
    relign_image reference;
    // The lens's best pose; nothing where the scene does not know it. Looked for once, when first asked for.
    std::function<std::optional<plugin_host::MountedAssembly::Optimum>()> own_optimum;
  };
  Placed place(const TrialJob& job);

  plugin_host::Scene& scene(const TrialJob& job);

 private:
  struct Bench;
  // `name` is shown before warnings; in a trial's log the algorithm's own lines have none.
  plugin_host::HostServices services(const std::string& name, unsigned threads, bool algorithm = false) const;
  Options options_;
  std::shared_ptr<TrialLog> log_;
  std::unique_ptr<Bench> bench_;
};

}  // namespace relign::runner
