#include "runner/run.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "base/machine.h"
#include "records/results_folder.h"
#include "runner/bounds.h"
#include "runner/pictures.h"
#include "runner/plan_pretraining.h"
#include "runner/provenance.h"
#include "runner/thread_worker.h"
#include "runner/trial_queue.h"
#include "runner/trial_selection.h"
#include "runner/worker_process.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

class Run {
 public:
  Run(const PreparedPlan& prepared, const RunOptions& options)
      : prepared_(prepared),
        suite_(prepared.plan.suite),
        options_(options),
        selected_(select_trials(prepared.plan, options.only)),
        writer_(options.results),
        hashes_(hash_libraries(suite_)),
        learnt_(prepared, pretrainer_options(), options.worker_program.empty() ? nullptr : in_a_worker()) {}

  RunSummary execute() {
    if (writer_.repaired() > 0)
      notify("the previous run ended while writing; half-written trials are dropped and run again");
    // First, because trials made with other pretrained data run again.
    learnt_.prepare(selected_, [this](const std::string& algorithm) { report_progress("pretraining " + algorithm); });
    pretraining_worker_.reset();
    drop_outdated();
    Json manifest = make_manifest(prepared_, hashes_, options_.command, learnt_.to_json());
    const Json before = writer_.read_manifest();
    compare_with(before, manifest);
    remember_first_analysis(before, manifest);
    writer_.write_manifest(manifest);
    const std::vector<std::size_t> todo = plan_work();
    report_progress("trials");
    if (!todo.empty()) {  // an earlier verification does not cover new trials
      std::error_code code;
      fs::remove(options_.results / "verify.json", code);
    }
    work(todo);

    std::vector<std::string> order;
    for (const suites::PlannedTrial& trial : prepared_.plan.trials) order.push_back(trial.id);
    writer_.finish(order);
    if (!stop_requested()) {
      report_progress("pictures");
      PictureOptions pictures;
      pictures.cache_folder = options_.cache_folder;
      pictures.threads = core_count();
      pictures.stop = options_.stop;
      pictures.on_message = [this](const std::string& message) { notify(message); };
      pictures.draw_lens = options_.draw_lens;
      write_pictures(prepared_, options_.results, pictures);
      write_bounds(prepared_, selected_, options_.results, pictures);
    }
    summary_.stopped = stop_requested();
    summary_.seconds = seconds_since(begin_);
    collect_failures();
    return summary_;
  }

 private:
  bool stop_requested() const { return options_.stop && options_.stop->load(); }

  void notify(const std::string& message) {
    if (!options_.on_message) return;
    const std::lock_guard<std::mutex> hold(notify_mutex_);
    options_.on_message(message);
  }

  void report_progress(const std::string& doing) {
    const std::lock_guard<std::mutex> hold(progress_mutex_);
    if (!doing.empty()) progress_.doing = doing;
    progress_.seconds = seconds_since(begin_);
    if (options_.on_progress) options_.on_progress(progress_);
  }

  Pretrainer::Options pretrainer_options() {
    Pretrainer::Options options;
    options.threads = core_count();
    options.cache_folder = options_.cache_folder;
    options.on_message = [this](const std::string& message) { notify(message); };
    options.stop = options_.stop;
    return options;
  }

  // Pretrains in one worker process, so that faults of a plugin affect only its own trials.
  PlanPretraining::Make in_a_worker() {
    return [this](const suites::PlannedTrial& trial) {
      if (!pretraining_worker_) pretraining_worker_ = process_worker(core_count(), options_.stop);
      return pretraining_worker_->prepare(trial);
    };
  }

  std::string hash_of(const plugin_host::Choice& choice) const { return runner::hash_of(choice, hashes_); }
  records::PluginHashes plugins_of(const suites::PlannedTrial& trial) const {
    return {hash_of(suite_.scenes[trial.scene].choice), hash_of(suite_.levels[trial.level].choice),
            hash_of(suite_.algorithms[trial.algorithm].choice),
            learnt_.of(trial) ? runner::hash_of(*learnt_.of(trial)) : ""};
  }

  // Drops finished trials that this plan would not reproduce, because their plugins or display names changed. They run
  // again.
  void drop_outdated() {
    const std::map<std::string, records::FinishedTrial> finished = writer_.finished();
    std::map<std::string, std::size_t> changed;  // plugin id -> trials
    std::size_t renamed = 0, retried = 0;
    std::set<std::string> outdated;
    for (const std::size_t place : selected_) {
      const suites::PlannedTrial& trial = prepared_.plan.trials[place];
      const auto found = finished.find(trial.id);
      if (found == finished.end()) continue;
      const records::FinishedTrial& before = found->second;
      const records::PluginHashes now = plugins_of(trial);
      const auto check = [&](const std::string& was, const std::string& is, const plugin_host::Choice& choice) {
        if (was.empty() || was == is) return false;
        ++changed[choice.plugin->id];
        return true;
      };
      const bool scene = check(before.plugins.scene, now.scene, suite_.scenes[trial.scene].choice);
      const bool level = check(before.plugins.noise_level, now.noise_level, suite_.levels[trial.level].choice);
      const bool algorithm = check(before.plugins.algorithm, now.algorithm, suite_.algorithms[trial.algorithm].choice);
      // Also when pretraining failed before, and the trials with it.
      const bool learnt = !algorithm && !now.prepared.empty() && before.plugins.prepared != now.prepared;
      if (learnt) ++changed["pretrained data of " + suite_.algorithms[trial.algorithm].choice.plugin->id];
      if (scene) remove_scene_files(trial.scene);
      const bool named =
          before.scene != suite_.scenes[trial.scene].name || before.noise_level != suite_.levels[trial.level].name;
      const bool again = options_.retry_failed && !records::ended_well(before.end);
      if (again) ++retried;
      if (scene || level || algorithm || learnt || again) {
        outdated.insert(trial.id);
      } else if (named) {
        ++renamed;
        outdated.insert(trial.id);
      }
    }
    for (const auto& [plugin, trials] : changed)
      notify(plugin + " changed: " + std::to_string(trials) +
             (trials == 1 ? " trial runs again" : " trials run again"));
    if (retried > 0)
      notify(std::to_string(retried) + (retried == 1 ? " failed trial runs" : " failed trials run") + " again");
    if (renamed > 0)
      notify("scenes or noise levels were renamed in the suite: " + std::to_string(renamed) +
             (renamed == 1 ? " trial runs again" : " trials run again"));
    writer_.drop(outdated);
    for (const std::string& trial : outdated) {
      std::error_code code;
      fs::remove_all(options_.results / "pictures" / trial, code);
    }
  }

  void remove_scene_files(std::size_t scene) {
    std::error_code code;  // ignored: remaining pictures are overwritten or still valid
    fs::remove_all(options_.results / scene_folder(prepared_, scene), code);
    fs::remove_all(options_.results / "pictures" / suite_.scenes[scene].name, code);
  }

  void compare_with(const Json& before, const Json& now) {
    if (!before.is_object()) return;
    const auto program = Json::json_pointer("/program/hash");
    const std::string was = before.value(program, std::string());
    const std::string is = now.value(program, std::string());
    std::set<std::string> planned;
    for (const suites::PlannedTrial& trial : prepared_.plan.trials) planned.insert(trial.id);
    std::size_t kept = 0;
    std::size_t extra = 0;
    for (const std::string& trial : writer_.finished_trials()) ++(planned.count(trial) ? kept : extra);
    if (kept > 0 && !was.empty() && !is.empty() && was != is)
      notify("relign-bench has changed since the first of these results; " + std::to_string(kept) +
             " finished trials are kept (choose a new folder with --out to run all of them again)");
    if (extra == 0) return;
    const std::string file = before.value("suite_file", std::string());
    const bool same_file = file.empty() || file == suite_.file;
    notify(std::to_string(extra) + (extra == 1 ? " finished trial in " : " finished trials in ") +
           options_.results.string() + (extra == 1 ? " belongs to " : " belong to ") +
           (same_file ? "an earlier version of the suite"
                      : "another suite, " + file + " (this one is " + suite_.file + ")") +
           (extra == 1 ? "; it is kept but not shown" : "; they are kept but not shown") +
           (same_file ? "" : "; give the suites different names, or one of them another folder with --out"));
  }

  // An analysis plan that was changed after the first results is not pre-registered: reports mark it.
  void remember_first_analysis(const Json& before, Json& now) {
    if (!before.is_object() || writer_.finished_trials().empty()) return;
    const std::string first = before.value("analysis_began_with", before.value("analysis_hash", std::string("none")));
    if (first == now.value("analysis_hash", std::string("none"))) return;
    now["analysis_began_with"] = first;
    notify("the suite's analysis plan has changed since the first of these results; the report marks it as changed");
  }

  std::vector<std::size_t> plan_work() {
    const std::map<std::string, records::FinishedTrial> finished = writer_.finished();
    std::vector<std::size_t> todo;
    for (const std::size_t place : selected_) {
      const auto found = finished.find(prepared_.plan.trials[place].id);
      if (found == finished.end()) {
        todo.push_back(place);
        continue;
      }
      ++summary_.reused;
      if (!records::ended_well(found->second.end)) ++summary_.failed;
    }
    summary_.trials = selected_.size();
    summary_.finished = summary_.reused;
    progress_.total = summary_.trials;
    progress_.done = progress_.reused = summary_.reused;
    progress_.failed = summary_.failed;
    return todo;
  }

  void work(const std::vector<std::size_t>& todo) {
    if (todo.empty()) return;
    const unsigned cores = core_count();
    // A station is one machine: its trials run one after the other.
    const bool station = std::any_of(todo.begin(), todo.end(), [this](std::size_t place) {
      return prepared_.scenes[prepared_.plan.trials[place].scene].owns_stage;
    });
    const std::size_t wanted = station ? 1 : options_.workers == 0 ? cores : options_.workers;
    if (station && options_.workers > 1) notify("using one worker: a station runs one trial at a time");
    const auto workers = static_cast<unsigned>(std::min<std::size_t>(wanted, todo.size()));
    const unsigned threads = std::max(1U, cores / workers);
    workers_ = workers;
    std::vector<std::vector<std::size_t>> groups = group_by_instance(prepared_.plan, todo);
    for (std::vector<std::size_t>& group : groups)
      for (std::size_t& place : group) place = todo[place];
    TrialQueue queue(std::move(groups));
    std::vector<std::thread> team;
    try {
      for (unsigned number = 0; number < workers; ++number)
        team.emplace_back([this, &queue, threads] {
          work_through(queue, threads);
          const std::lock_guard<std::mutex> hold(progress_mutex_);
          ++workers_done_;
          worker_is_done_.notify_one();
        });
    } catch (const std::system_error&) {
      // Fewer threads than requested do the same work; without any, this thread does it.
      if (team.empty()) work_through(queue, threads);
    }
    wait_for(team);
    if (failure_) std::rethrow_exception(failure_);
  }

  // Polls the stop flag here, because a worker may be waiting for a trial that hangs.
  void wait_for(std::vector<std::thread>& team) {
    {
      std::unique_lock<std::mutex> hold(progress_mutex_);
      while (workers_done_ < team.size()) {
        worker_is_done_.wait_for(hold, std::chrono::milliseconds(100));
        if (stop_requested()) halt_ = true;
      }
    }
    for (std::thread& worker : team) worker.join();
  }

  WorkerOptions worker_options(unsigned threads, const std::atomic<bool>* stop) {
    WorkerOptions options;
    options.threads = threads;
    options.results = options_.results;
    options.cache_folder = options_.cache_folder;
    options.on_message = [this](const std::string& message) { notify(message); };
    options.stop = stop;
    return options;
  }

  std::unique_ptr<ProcessWorker> process_worker(unsigned threads, const std::atomic<bool>* stop) {
    return std::make_unique<ProcessWorker>(prepared_, hashes_, options_.worker_program, worker_limits(),
                                           worker_options(threads, stop));
  }

  std::unique_ptr<TrialWorker> make_worker(unsigned threads) {
    if (options_.worker_program.empty())
      return std::make_unique<ThreadWorker>(prepared_, worker_options(threads, &halt_));
    return process_worker(threads, &halt_);
  }

  ProcessWorker::Limits worker_limits() const {
    constexpr double kShareOfMachine = 0.8;
    const auto machine = static_cast<std::size_t>(kShareOfMachine * static_cast<double>(usable_memory_bytes()));
    ProcessWorker::Limits limits;
    limits.trial_seconds = suite_.trial_seconds;
    limits.memory_bytes = suite_.trial_memory_mb > 0 ? std::size_t{suite_.trial_memory_mb} * 1'000'000 : machine;
    limits.spare_bytes = std::min(limits.memory_bytes, machine / workers_) / 2;
    return limits;
  }

  void work_through(TrialQueue& queue, unsigned threads) {
    try {
      const std::unique_ptr<TrialWorker> worker = make_worker(threads);
      std::size_t group = TrialQueue::kNoGroup;
      double writing_seconds = 0;  // of the previous trial
      while (!halt_) {
        if (stop_requested()) halt_ = true;
        if (halt_) break;
        const std::optional<std::size_t> place = queue.next(group);
        if (!place) break;
        run_one(*worker, *place, writing_seconds);
      }
    } catch (...) {
      const std::lock_guard<std::mutex> hold(progress_mutex_);
      if (!failure_) failure_ = std::current_exception();
      halt_ = true;
    }
  }

  void run_one(TrialWorker& worker, std::size_t place, double& writing_seconds) {
    const suites::PlannedTrial& trial = prepared_.plan.trials[place];
    // The worker checks halt_ before each step; it is also set when another worker fails.
    WorkedTrial worked = worker.run(trial, learnt_.of(trial));
    if (worked.stopped) return;
    worked.times.plugins = plugins_of(trial);
    worked.times.harness_seconds += writing_seconds;
    const auto begin = std::chrono::steady_clock::now();
    writer_.write_log(trial.id, worked.log);
    writer_.append(place, worked.record, worked.step_lines, worked.steps, worked.times);
    writing_seconds = seconds_since(begin);
    {
      const std::lock_guard<std::mutex> hold(progress_mutex_);
      ++summary_.finished;
      ++progress_.done;
      if (!records::ended_well(worked.record.end)) {
        ++summary_.failed;
        ++progress_.failed;
      }
    }
    report_progress("");
  }

  void collect_failures() {
    const std::map<std::string, records::FinishedTrial> finished = writer_.finished();
    for (const std::size_t place : selected_) {
      const suites::PlannedTrial& trial = prepared_.plan.trials[place];
      const auto found = finished.find(trial.id);
      if (found == finished.end() || records::ended_well(found->second.end)) continue;
      summary_.failures.push_back("trial " + trial.id + " " + suite_.algorithms[trial.algorithm].name + " on " +
                                  suite_.scenes[trial.scene].name + " " + suite_.levels[trial.level].name + " #" +
                                  std::to_string(trial.instance) + ": " + found->second.message + log_hint(trial.id));
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
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::vector<std::size_t> selected_;
  records::ResultsWriter writer_;
  LibraryHashes hashes_;
  std::unique_ptr<ProcessWorker> pretraining_worker_;
  PlanPretraining learnt_;
  std::atomic<bool> halt_{false};
  std::mutex notify_mutex_;
  std::mutex progress_mutex_;  // also guards summary_, failure_ and workers_done_ while workers run
  std::condition_variable worker_is_done_;
  unsigned workers_ = 1;
  std::size_t workers_done_ = 0;
  Progress progress_;
  RunSummary summary_;
  std::exception_ptr failure_;
};

}  // namespace

RunSummary run(const PreparedPlan& prepared, const RunOptions& options) { return Run(prepared, options).execute(); }

}  // namespace relign::runner
