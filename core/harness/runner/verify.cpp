#include "runner/verify.h"

#include <algorithm>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <unordered_map>

#include "base/error.h"
#include "base/machine.h"
#include "base/own_command.h"
#include "records/checksum.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"
#include "runner/plan_check.h"
#include "runner/plan_pretraining.h"
#include "runner/provenance.h"
#include "runner/trial_queue.h"
#include "runner/trial_runner.h"
#include "runner/trial_selection.h"
#include "runner/verify_folder.h"
#include "suites/secret.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

bool promises_this_cpu(const plugin_host::Choice& choice) { return reproducible_of(choice) == "this_cpu"; }

// Replays the trials of one suite.
class Replay {
 public:
  Replay(const VerifyOptions& options, const PreparedPlan& prepared, const records::Manifest& manifest,
         std::map<std::string, records::PluginHashes> plugins)
      : options_(options),
        prepared_(prepared),
        suite_(prepared.plan.suite),
        recorded_plugins_(std::move(plugins)),
        hashes_(hash_libraries(suite_)),
        learnt_(prepared, pretrainer_options()),
        other_cpu_(made_on_another_processor(manifest)) {}

  // `places[i]` is the position of trials[i] in the plan.
  void run(const std::vector<ChosenTrial>& trials, const std::vector<std::size_t>& places, VerifySummary& summary,
           std::set<Change>& changes, const std::function<void()>& on_done) {
    learnt_.prepare(places, [](const std::string&) {});
    for (const std::size_t place : places) compare_plugins(prepared_.plan.trials[place], changes);
    TrialQueue queue(group_by_instance(prepared_.plan, places));
    found_.assign(trials.size(), std::nullopt);
    const unsigned cores = core_count();
    const auto workers = static_cast<unsigned>(std::min<std::size_t>(options_.on_step        ? 1
                                                                     : options_.workers == 0 ? cores
                                                                                             : options_.workers,
                                                                     places.size()));
    std::vector<std::thread> team;
    for (unsigned worker = 1; worker < workers; ++worker)
      team.emplace_back([&] { work(trials, places, queue, std::max(1U, cores / workers), summary, on_done); });
    work(trials, places, queue, std::max(1U, cores / std::max(1U, workers)), summary, on_done);
    for (std::thread& worker : team) worker.join();
    if (failure_) std::rethrow_exception(failure_);
    for (std::optional<ReplayDifference>& one : found_)
      if (one) summary.differences.push_back(std::move(*one));
  }

 private:
  Pretrainer::Options pretrainer_options() const {
    Pretrainer::Options options;
    options.threads = core_count();
    options.cache_folder = options_.cache_folder;
    options.on_message = options_.on_message;
    options.stop = options_.stop;
    options.sandbox = options_.sandbox;
    return options;
  }

  void compare_plugins(const suites::PlannedTrial& trial, std::set<Change>& changes) const {
    const auto found = recorded_plugins_.find(trial.id);
    if (found == recorded_plugins_.end()) return;
    const auto compare = [&changes](const std::string& what, const std::string& was, const std::string& is) {
      if (!was.empty() && was != is) changes.insert({what, was.substr(0, 16), is.empty() ? "none" : is.substr(0, 16)});
    };
    const auto of = [this, &compare](const plugin_host::Choice& choice, const std::string& was) {
      compare("plugin " + choice.plugin->id, was, hash_of(choice, hashes_));
    };
    of(suite_.scenes[trial.scene].choice, found->second.scene);
    of(suite_.levels[trial.level].choice, found->second.noise_level);
    of(suite_.algorithms[trial.algorithm].choice, found->second.algorithm);
    const Pretrainer::Entries* entries = learnt_.of(trial);
    compare("pretrained data of " + suite_.algorithms[trial.algorithm].name, found->second.prepared,
            entries ? runner::hash_of(*entries) : "");
  }

  bool stopped() const { return options_.stop && options_.stop->load(); }

  void work(const std::vector<ChosenTrial>& trials, const std::vector<std::size_t>& places, TrialQueue& queue,
            unsigned threads, VerifySummary& summary, const std::function<void()>& on_done) {
    try {
      TrialRunner runner({.threads = threads,
                          .cache_folder = options_.cache_folder,
                          .on_message = {},
                          .stop = options_.stop,
                          .sandbox = options_.sandbox});
      std::size_t group = TrialQueue::kNoGroup;
      while (!stopped()) {
        const std::optional<std::size_t> index = queue.next(group);
        if (!index) break;
        replay(runner, trials[*index], prepared_.plan.trials[places[*index]], *index, summary, on_done);
      }
    } catch (...) {
      const std::lock_guard<std::mutex> hold(mutex_);
      if (!failure_) failure_ = std::current_exception();
      while (queue.next(skip_)) {
      }
    }
  }

  void replay(TrialRunner& runner, const ChosenTrial& chosen, const suites::PlannedTrial& trial, std::size_t index,
              VerifySummary& summary, const std::function<void()>& on_done) {
    std::string lines;
    records::TrialRecord was;
    try {
      was = records::read_stored(options_.results, chosen.where, &lines);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input) throw;
      const std::lock_guard<std::mutex> hold(mutex_);
      summary.damaged.push_back({(options_.results / "trials").string(), 0, trial.id, error.what()});
      return on_done();
    }
    TrialJob job = make_job(prepared_, trial);
    if (const Pretrainer::Entries* entries = learnt_.of(trial)) job.prepared = data_of(*entries);
    const auto show = [&](const trials::Step& step, const float* pixels) {
      if (options_.on_step) options_.on_step(job.facts, step, pixels);
    };
    TrialOutcome outcome = runner.run(job, options_.stop, show);
    if (outcome.stopped) return;
    const bool tolerant = other_cpu_ && (promises_this_cpu(job.scene) || promises_this_cpu(job.level) ||
                                         promises_this_cpu(job.algorithm));
    const std::set<std::string> cleared = records::clear_later(was, outcome.record);
    std::optional<records::Difference> difference =
        records::first_difference(was, outcome.record, tolerant ? records::kOtherCpuTolerance : 0);
    // Equal numbers in different bytes: the file was edited.
    const bool same_bytes = records::without_checksum(lines) == records::to_lines(outcome.record) + "\n";
    if (!difference && !tolerant && !same_bytes)
      difference = records::Difference{true, 0, "bytes of the lines", "other", "other bytes for equal values", 0};
    const std::lock_guard<std::mutex> hold(mutex_);
    ++summary.replayed;
    for (const std::string& key : cleared) ++summary.not_compared[key];
    records::ReplayCounts& of_method = summary.methods[{was.algorithm, was.protocol}];
    ++of_method.replayed;
    if (!difference) ++of_method.equal;
    if (difference) {
      found_[index] = ReplayDifference{trial.id, records::label_of(was), *difference, tolerant};
    } else {
      ++summary.equal;
      if (!same_bytes) {
        ++summary.with_tolerance;
        summary.largest_deviation =
            std::max(summary.largest_deviation, records::largest_difference(was, outcome.record));
      }
    }
    on_done();
  }

  const VerifyOptions& options_;
  const PreparedPlan& prepared_;
  const suites::Suite& suite_;
  std::map<std::string, records::PluginHashes> recorded_plugins_;
  LibraryHashes hashes_;
  PlanPretraining learnt_;
  bool other_cpu_;
  std::mutex mutex_;  // guards the members below and the summary
  std::vector<std::optional<ReplayDifference>> found_;
  std::exception_ptr failure_;
  std::size_t skip_ = TrialQueue::kNoGroup;
};

suites::Suite read_suite(const records::StoredSuite& stored, const std::string& published, const VerifyOptions& options,
                         plugin_host::Catalog& catalog) {
  const fs::path folder = options.suite_folder.empty() ? fs::path(stored.file).parent_path() : options.suite_folder;
  try {
    suites::Suite suite =
        suites::read_suite(JsonSource::from_text(stored.text, stored.file), folder.empty() ? "." : folder, catalog);
    suite.name = stored.name;
    if (const std::string& secret = options.secret.empty() ? published : options.secret; !suite.commitment.empty()) {
      if (secret.empty())
        throw Error(ErrorKind::bad_input,
                    "these results are sealed; who has the secret can replay them with --secret "
                    "FILE, or publish it in them with '" +
                        own_command("unseal") + "'");
      suites::unseal(suite, secret);
    }
    return suite;
  } catch (const Error& error) {
    std::error_code code;
    if (!folder.empty() && !fs::is_directory(folder, code))
      throw Error(error.kind(), "the suite of these results was read from " + stored.file +
                                    " and needs files beside it, but there is no folder " + folder.string() +
                                    "; give their folder with --suite-folder DIR. Errors without them:\n" +
                                    error.what());
    throw Error(error.kind(), std::string("cannot read the suite of these results:\n") + error.what() +
                                  "\nits files are searched in " +
                                  (folder.empty() ? "the current folder" : folder.string()) +
                                  " (--suite-folder DIR), its plugins in the usual folders and at --plugin PATH");
  }
}

}  // namespace

VerifySummary verify(const VerifyOptions& options, plugin_host::Catalog& catalog) {
  records::require_results(options.results);
  const records::Manifest manifest = records::manifest_of(options.results);
  records::require_consistent(manifest, options.results);
  VerifySummary summary;
  records::FolderChecks checks(manifest, options.results);
  std::vector<ChosenTrial> rest = choose_trials(options, manifest, summary, checks);
  std::map<std::string, records::PluginHashes> plugins;
  for (const ChosenTrial& trial : rest) plugins[trial.id];
  const auto take_plugins = [&plugins, &checks](const records::TrialTimes& times) {
    checks.add(times);
    if (const auto found = plugins.find(times.trial); found != plugins.end()) found->second = times.plugins;
  };
  records::for_each_times(options.results, take_plugins, &summary.damaged);

  std::set<Change> changes;
  compare_machines(manifest, changes);
  const std::size_t total = rest.size();
  std::size_t done = 0;
  const auto on_done = [&] {
    if (options.on_progress) options.on_progress(++done, total);
  };
  std::vector<PreparedPlan> plans;
  if (!rest.empty())
    for (const records::StoredSuite& stored : manifest.stored_suites())
      plans.push_back(prepare(read_suite(stored, manifest.secret, options, catalog), options.cache_folder,
                              options.on_message, options.stop, options.sandbox));
  records::refuse_contradictions(plan_contradictions(manifest, plans), options.results);
  records::Check plan;  // compared with the scenes themselves where they were created
  plan.name = "plan";
  summary.checks = checks.result(plans.empty() ? check_plan(manifest, catalog, options.suite_folder) : plan);
  for (const PreparedPlan& prepared : plans) {
    compare_definitions(manifest, prepared, changes);
    std::unordered_map<std::string, std::size_t> place_of;
    for (std::size_t place = 0; place < prepared.plan.trials.size(); ++place)
      place_of.emplace(prepared.plan.trials[place].id, place);
    std::vector<ChosenTrial> mine, others;
    std::vector<std::size_t> places;
    for (ChosenTrial& trial : rest) {
      const auto found = place_of.find(trial.id);
      if (found != place_of.end()) places.push_back(found->second);
      (found != place_of.end() ? mine : others).push_back(std::move(trial));
    }
    rest = std::move(others);
    if (!mine.empty()) Replay(options, prepared, manifest, plugins).run(mine, places, summary, changes, on_done);
  }
  summary.stopped = options.stop && options.stop->load();
  summary.unknown = rest.size();
  summary.changes.assign(changes.begin(), changes.end());
  return summary;
}

}  // namespace relign::runner
