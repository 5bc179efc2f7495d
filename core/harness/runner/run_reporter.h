// Reports a run to its caller: progress, and messages such as "compass changed: 30 trials run again".
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
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

  void begin(const std::string& activity);  // "trials", "pictures"
  // Before the first trial: `reused` trials are finished already, `failed` of them with a failure.
  void set_trials(std::size_t total, std::size_t reused, std::size_t failed);
  void trial_finished(bool well);

  double seconds() const;
  Progress progress() const;

 private:
  void report();  // the caller holds progress_mutex_

  const RunOptions& options_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex message_mutex_;
  mutable std::mutex progress_mutex_;
  Progress progress_;
};

}  // namespace relign::runner
