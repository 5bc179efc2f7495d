#include "runner/run_reporter.h"

#include <algorithm>
#include <utility>

namespace relign::runner {
namespace {

// An estimate runs through all remaining trials, while workers wait for the reporter: of a large plan it is made less
// often.
constexpr double kSecondsBetweenEstimates = 0.5;
constexpr double kMostTimeOfEstimates = 0.01;  // share

}  // namespace

void RunReporter::message(const std::string& text) {
  if (!options_.on_message) return;
  const std::lock_guard<std::mutex> hold(message_mutex_);
  options_.on_message(text);
}

std::function<void(const std::string&)> RunReporter::on_message() {
  return [this](const std::string& text) { message(text); };
}

void RunReporter::begin(const std::string& activity, std::optional<TimeLeft> estimate) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  progress_.doing = activity;
  progress_.estimates = estimate.has_value();
  progress_.left.reset();
  estimate_ = std::move(estimate);
  next_estimate_ = 0;
  report();
}

void RunReporter::set_trials(std::size_t total, std::size_t reused, std::size_t failed) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  progress_.total = total;
  progress_.done = progress_.reused = reused;
  progress_.failed = failed;
}

void RunReporter::trial_begun(std::size_t worker, std::size_t place) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  begun_at_[worker] = seconds();
  if (estimate_) estimate_->begin(worker, place, begun_at_[worker]);
}

void RunReporter::trial_advanced(std::size_t worker, std::size_t captures) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  if (estimate_) estimate_->advance(worker, captures, seconds());
}

void RunReporter::trial_finished(std::size_t worker, bool well, const records::TrialTimes& times) {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  ++progress_.done;
  if (!well) ++progress_.failed;
  if (estimate_) estimate_->end(worker, spent_time(times, seconds() - begun_at_[worker]));
  report();
}

void RunReporter::refresh() {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  if (estimate_ && seconds() >= next_estimate_) report();
}

double RunReporter::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

Progress RunReporter::progress() const {
  const std::lock_guard<std::mutex> hold(progress_mutex_);
  return progress_;
}

void RunReporter::report() {
  const double now = seconds();
  if (estimate_ && now >= next_estimate_) {
    progress_.left = estimate_->at(now);
    next_estimate_ = now + std::max(kSecondsBetweenEstimates, (seconds() - now) / kMostTimeOfEstimates);
  } else if (progress_.left) {
    const double passed = now - progress_.seconds;
    for (double* of : {&progress_.left->seconds, &progress_.left->least, &progress_.left->most})
      *of = std::max(0.0, *of - passed);
  }
  progress_.seconds = now;
  if (options_.on_progress) options_.on_progress(progress_);
}

}  // namespace relign::runner
