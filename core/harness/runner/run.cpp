#include "runner/run.h"

#include <map>
#include <memory>

#include "base/machine.h"
#include "records/results_folder.h"
#include "records/stored_trials.h"
#include "runner/bounds.h"
#include "runner/earlier_run.h"
#include "runner/pictures.h"
#include "runner/plan_pretraining.h"
#include "runner/provenance.h"
#include "runner/run_reporter.h"
#include "runner/trial_selection.h"
#include "runner/worker_factory.h"
#include "runner/worker_team.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

// The order of a run: pretraining, what an earlier run left, trials, pictures.
class Run {
 public:
  Run(const PreparedPlan& prepared, const RunOptions& options)
      : prepared_(prepared),
        suite_(prepared.plan.suite),
        options_(options),
        reporter_(options),
        selected_(select_trials(prepared.plan, options.only)),
        writer_(options.results, options.drop_damaged ? records::ResultsWriter::OnDamage::drop
                                                      : records::ResultsWriter::OnDamage::refuse),
        hashes_(hash_libraries(suite_)),
        factory_(prepared, options, hashes_, reporter_),
        learnt_(prepared, pretrainer_options(), options.worker_program.empty() ? nullptr : in_a_worker()) {}

  RunSummary execute() {
    if (writer_.repaired() > 0)
      reporter_.message("the previous run ended while writing; half-written trials are dropped and run again");
    for (const records::Damage& damage : writer_.dropped()) reporter_.message("dropped: " + records::to_string(damage));
    remember_times();
    // First, because trials made with other pretrained data run again.
    learnt_.prepare(selected_, [this](const std::string& algorithm) { reporter_.begin("pretraining " + algorithm); });
    pretraining_worker_.reset();
    run_trials(continue_earlier_run());
    finish_records();
    if (!stop_requested()) write_all_pictures();
    remove_temporary_files(options_.results);  // of workers and earlier runs that were killed
    return summary();
  }

 private:
  bool stop_requested() const { return options_.stop && options_.stop->load(); }

  Pretrainer::Options pretrainer_options() {
    Pretrainer::Options options;
    options.threads = core_count();
    options.cache_folder = options_.cache_folder;
    options.on_message = reporter_.on_message();
    options.stop = options_.stop;
    options.sandbox = options_.sandbox;
    return options;
  }

  // Pretrains in one worker process, so that faults of a plugin affect only its own trials.
  PlanPretraining::Make in_a_worker() {
    return [this](const suites::PlannedTrial& trial) {
      if (!pretraining_worker_) pretraining_worker_ = factory_.make_process(1, core_count(), options_.stop);
      return pretraining_worker_->prepare(trial);
    };
  }

  records::PluginHashes plugins_of(const suites::PlannedTrial& trial) const {
    const auto hash = [this](const plugin_host::Choice& choice) { return hash_of(choice, hashes_); };
    const Pretrainer::Entries* learnt = learnt_.of(trial);
    return {hash(suite_.scenes[trial.scene].choice), hash(suite_.levels[trial.level].choice),
            hash(suite_.algorithms[trial.algorithm].choice), learnt ? hash_of(*learnt) : ""};
  }

  // Before outdated trials are removed, whose times are estimates for the new ones.
  void remember_times() {
    std::map<std::string, std::size_t> places;
    for (const std::size_t place : selected_) places[prepared_.plan.trials[place].id] = place;
    std::vector<records::Damage> ignored;
    records::for_each_times(
        options_.results,
        [&](const records::TrialTimes& times) {
          if (const auto found = places.find(times.trial); found != places.end())
            earlier_times_[found->second] = spent_time(times, records::step_seconds(times));
        },
        &ignored);
  }

  // Returns the positions of the trials that are still to be run.
  std::vector<std::size_t> continue_earlier_run() {
    EarlierRun earlier(prepared_, options_, selected_, writer_, reporter_);
    earlier.compare_sandbox();
    earlier.drop_outdated([this](const suites::PlannedTrial& trial) { return plugins_of(trial); });
    records::Manifest manifest = make_manifest(prepared_, hashes_, options_.command, learnt_.recorded());
    if (options_.sandbox) manifest.sandbox = limits_of(*options_.sandbox);
    earlier.compare_with(manifest);
    earlier.mark_changed_analysis(manifest);
    earlier.keep_secret(manifest);
    writer_.write_manifest(manifest);
    const EarlierRun::Remaining remaining = earlier.remaining();
    reporter_.set_trials(selected_.size(), remaining.finished, remaining.failed);
    return remaining.places;
  }

  void run_trials(const std::vector<std::size_t>& todo) {
    if (todo.empty()) return reporter_.begin("trials");
    std::error_code code;
    fs::remove(options_.results / "verify.json", code);  // an earlier verification does not cover new trials
    WorkerTeam team(prepared_, learnt_, factory_, reporter_, options_.stop,
                    [this](std::size_t place, WorkedTrial& worked) { record(place, worked); });
    team.run(todo, options_.workers, earlier_times_);
  }

  void record(std::size_t place, WorkedTrial& worked) {
    const suites::PlannedTrial& trial = prepared_.plan.trials[place];
    worked.times.plugins = plugins_of(trial);
    writer_.write_log(trial.id, worked.log);
    writer_.append(place, worked.record, worked.step_lines, worked.steps, worked.times);
  }

  void finish_records() {
    std::vector<std::string> order;
    for (const suites::PlannedTrial& trial : prepared_.plan.trials) order.push_back(trial.id);
    writer_.finish(order);
  }

  void write_all_pictures() {
    reporter_.begin("pictures");
    PictureOptions pictures;
    pictures.cache_folder = options_.cache_folder;
    pictures.threads = core_count();
    pictures.stop = options_.stop;
    pictures.on_message = reporter_.on_message();
    pictures.draw_lens = options_.draw_lens;
    write_pictures(prepared_, options_.results, pictures);
    write_bounds(prepared_, selected_, options_.results, pictures);
  }

  RunSummary summary() const {
    const Progress progress = reporter_.progress();
    RunSummary summary;
    summary.trials = progress.total;
    summary.finished = progress.done;
    summary.reused = progress.reused;
    summary.failed = progress.failed;
    summary.stopped = stop_requested();
    summary.seconds = reporter_.seconds();
    add_failures(summary);
    return summary;
  }

  void add_failures(RunSummary& summary) const {
    const std::map<std::string, records::FinishedTrial> finished = writer_.finished();
    for (const std::size_t place : selected_) {
      const suites::PlannedTrial& trial = prepared_.plan.trials[place];
      const auto found = finished.find(trial.id);
      if (found == finished.end() || records::ended_well(found->second.end)) continue;
      summary.failed_ends.insert(found->second.end);
      summary.failures.push_back("trial " + trial.id + " " + suite_.algorithms[trial.algorithm].name + " on " +
                                 suite_.scenes[trial.scene].name + " " + suite_.levels[trial.level].name + " #" +
                                 std::to_string(trial.instance) + ": " + found->second.end + ": " +
                                 found->second.message + log_hint(trial.id));
    }
  }

  std::string log_hint(const std::string& trial) const {
    const fs::path file = options_.results / records::log_file(trial);
    std::error_code code;
    return fs::exists(file, code) ? "\n  output of its plugins: " + file.string() : "";
  }

  const PreparedPlan& prepared_;
  const suites::Suite& suite_;
  const RunOptions& options_;
  RunReporter reporter_;  // first of the parts: it has the run's clock
  std::vector<std::size_t> selected_;
  records::ResultsWriter writer_;
  std::map<std::size_t, SpentTime> earlier_times_;  // of trials of an earlier run, by position
  LibraryHashes hashes_;
  WorkerFactory factory_;
  std::unique_ptr<ProcessWorker> pretraining_worker_;
  PlanPretraining learnt_;
};

}  // namespace

RunSummary run(const PreparedPlan& prepared, const RunOptions& options) {
  if (const suites::Suite& suite = prepared.plan.suite; !suite.commitment.empty() && !suite.seeds)
    throw Error(ErrorKind::internal, "a sealed suite was run without its secret");
  return Run(prepared, options).execute();
}

}  // namespace relign::runner
