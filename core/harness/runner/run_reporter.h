// Reports a run to its caller: progress, and messages such as "compass changed: 30 trials run again".
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "runner/run.h"

namespace relign::runner {

// All functions are thread-safe; the caller's functions are called one at a time.
class RunReporter {
 public:
  // `options` must outlive this object. The run's clock starts here.
  explicit RunReporter(const RunOptions& options) : options_(options) {}

  void message(const std::string& text);
  // For the options of parts that send messages; valid as long as this object.
  std::function<void(const std::string&)> on_message();

  // `activity`: "trials", "pictures". The estimate, if any, is reported until the next begin().
  void begin(const std::string& activity, std::optional<TimeLeft> estimate = std::nullopt);
  // Before the first trial: `reused` trials are finished already, `failed` of them with a failure.
  void set_trials(std::size_t total, std::size_t reused, std::size_t failed);
  void trial_begun(std::size_t worker, std::size_t place);
  void trial_advanced(std::size_t worker, std::size_t captures);
  void trial_finished(std::size_t worker, bool well, const records::TrialTimes& times);
  // Reports the time left again if the last report is old.
  void refresh();

  double seconds() const;
  Progress progress() const;

 private:
  void report();  // the caller holds progress_mutex_

  const RunOptions& options_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex message_mutex_;
  mutable std::mutex progress_mutex_;
  Progress progress_;
  std::optional<TimeLeft> estimate_;
  double next_estimate_ = 0;
  std::map<std::size_t, double> begun_at_;  // by worker
};

}  // namespace relign::runner
