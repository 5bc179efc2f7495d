#include "runner/run_reporter.h"

namespace relign::runner {

void RunReporter::message(const std::string& text) {
  if (!options_.on_message) return;
  const std::lock_guard<std::mutex> hold(message_mutex_);
  options_.on_message(text);
}

std::function<void(const std::string&)> RunReporter::on_message() {
  return [this](const std::string& text) { message(text); };
}

void RunReporter::begin(const std::string& activity) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  progress_.doing = activity;
  report();
}

void RunReporter::set_trials(std::size_t total, std::size_t reused, std::size_t failed) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  progress_.total = total;
  progress_.done = progress_.reused = reused;
  progress_.failed = failed;
}

void RunReporter::trial_finished(bool well) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  ++progress_.done;
  if (!well) ++progress_.failed;
  report();
}

double RunReporter::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

Progress RunReporter::progress() const {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  return progress_;
}

void RunReporter::report() {
  progress_.seconds = seconds();
  if (options_.on_progress) options_.on_progress(progress_);
}

}  // namespace relign::runner
