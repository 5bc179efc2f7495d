// Runs single trials from plain data, and keeps the scene, the noise level and the mounted lens for the next trial.
// Used by `run`, `try` and `verify`; one object per thread.
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
#include "trials/judge.h"
#include "trials/pretraining.h"
#include "trials/trial.h"

namespace relign::runner {

// Everything that a worker needs for one trial.
struct TrialJob {
  std::string id;
  std::string scene_name, level_name, algorithm_name;  // display names
  std::string method, training;                        // for an entry of a list of trainings; else empty
  plugin_host::Choice scene, level, algorithm;
  trials::SceneFacts facts;
  trials::Protocol protocol = trials::Protocol::paper;
  trials::Merit merit = trials::Merit::combined;
  trials::Limits limits = trials::Limits::soft;
  trials::MachineTime machine_time;  // the suite's values over the scene's
  unsigned budget = 50;              // steps after step 0
  double mtf_lp_per_mm = 0;          // of the specification; 0: no MTF
  trials::MtfLimits mtf_limits;      // of the specification, for merit mtf
  trials::Criteria criteria;         // of the specification, judged after every step
  suites::Seeds seeds;
  bool sealed = false;  // the record keeps no seed
  std::uint64_t instance = 0;
  std::shared_ptr<const trials::PreparedByIdentity> prepared = nullptr;  // pretrained data of its algorithms
  // Not null: pretraining on `instance`, a source instance (pretraining.h).
  trials::PretrainingState* pretraining = nullptr;
};

// The record of a trial before its first step: names, numbers, budget.
records::TrialRecord begin_record(const TrialJob& job);

TrialJob make_job(const PreparedPlan& prepared, const suites::PlannedTrial& trial);

struct TrialOutcome {
  records::TrialRecord record;
  records::TrialTimes times;  // plugin hashes not filled in
  std::string log;            // output of its plugins; may be empty
  double seconds = 0;         // from its first step to its end, host; includes harness_seconds of `times`
  bool stopped = false;       // ended by a stop: the record does not count
};

class TrialRunner {
 public:
  struct Options {
    unsigned threads = 1;  // for the scene
    std::filesystem::path cache_folder;
    std::function<void(const std::string&)> on_message;  // a plugin's warnings; any thread
    const std::atomic<bool>* stop = nullptr;             // for scenes and levels that run as processes; may be null
    std::function<void(std::string_view)> on_log = {};   // each piece of a trial's log; may be empty
    std::function<void()> on_runaway = {};               // see trials::Callbacks; may be empty
    // Called when the lens is mounted, with the record before the first step; may be empty.
    std::function<void(const records::TrialRecord&)> on_begin = {};
    std::shared_ptr<const plugin_host::Sandbox> sandbox = nullptr;  // for algorithms; null: none
  };
  explicit TrialRunner(Options options);
  ~TrialRunner();
  TrialRunner(const TrialRunner&) = delete;
  TrialRunner& operator=(const TrialRunner&) = delete;

  // A failure of algorithm, noise level or scene becomes a record with end "failed" and the steps so far.
  // Throws Error only for failures that concern more than this trial (a library that cannot be loaded).
  using OnStep = std::function<void(const trials::Step&, const float* pixels)>;
  TrialOutcome run(const TrialJob& job, const std::atomic<bool>* stop = nullptr, const OnStep& on_step = {});

  // Mounts the job's lens in its scene. References are valid until the next run or place.
  struct Placed {
    const trials::Instance& instance;
    plugin_host::MountedAssembly* assembly;  // null on a station, which has its own lens
    relign_image reference;
    // The lens's best pose, with its MTF if the job's specification has one. Computed at the first call.
    std::function<records::OwnOptimum()> own_optimum;
  };
  Placed place(const TrialJob& job);

  plugin_host::Scene& scene(const TrialJob& job);

 private:
  struct Bench;
  // `name` precedes warnings; in a trial's log the algorithm's lines have none.
  plugin_host::HostServices services(const std::string& name, unsigned threads, bool algorithm = false) const;
  void judge(const TrialJob& job, const std::vector<double>& own_optimum, records::TrialRecord& record);
  trials::StageSetup stage(const TrialJob& job, const Placed& placed) const;
  Options options_;
  std::shared_ptr<TrialLog> log_;
  std::unique_ptr<Bench> bench_;
};

}  // namespace relign::runner
