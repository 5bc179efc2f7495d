#include "runner/thread_worker.h"

#include <utility>

#include "runner/pictures.h"

namespace relign::runner {
namespace {

TrialRunner::Options runner_options(const WorkerOptions& options) {
  TrialRunner::Options own;
  own.threads = options.threads;
  own.cache_folder = options.cache_folder;
  own.on_message = options.on_message;
  if (options.on_captures) own.on_begin = [on = options.on_captures](const records::TrialRecord&) { on(0); };
  own.stop = options.stop;
  own.sandbox = options.sandbox;
  return own;
}

}  // namespace

ThreadWorker::ThreadWorker(const PreparedPlan& plan, WorkerOptions options)
    : plan_(plan), options_(std::move(options)), runner_(runner_options(options_)) {}

WorkedTrial ThreadWorker::run(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) {
  TrialJob job = make_job(plan_, trial);
  if (prepared) job.prepared = data_of(*prepared);
  const trials::SceneFacts& scene = plan_.scenes[trial.scene];
  KeptCaptures captures(scene);
  std::size_t made = 0;
  const TrialRunner::OnStep on_step = [&](const trials::Step& step, const float* pixels) {
    if (scene.owns_stage) captures.keep(step, pixels);
    if (options_.on_captures) options_.on_captures(++made);
  };
  TrialOutcome outcome = runner_.run(job, options_.stop, on_step);
  WorkedTrial worked;
  worked.stopped = outcome.stopped;
  if (outcome.stopped) return worked;
  if (scene.owns_stage) captures.write(options_.results, trial.id);
  for (const records::StepRecord& step : outcome.record.steps)
    worked.step_lines += records::step_line(trial.id, step) + "\n";
  worked.steps = outcome.record.steps.size();
  worked.record = std::move(outcome.record);
  worked.times = std::move(outcome.times);
  worked.log = std::move(outcome.log);
  return worked;
}

}  // namespace relign::runner
