// Ends a check whose plugin does not come back: a call into a library cannot be interrupted, so the
// process reports what is known and ends.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "conformance/finding.h"

namespace relign::conformance {

// Where the finding of this process goes: a file descriptor, or stdout (as JSON) when there is none.
void report_findings_to(int file_descriptor);
void report(const Finding& finding);

class Watchdog {
 public:
  Watchdog() = default;
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // From now on: when this process has used `cpu_seconds` of processor time, or `wall_seconds` went
  // by, `finding` is reported and the process ends. Replaces what was started before.
  void start(double cpu_seconds, double wall_seconds, Finding finding);
  void stop();

 private:
  using Clock = std::chrono::steady_clock;
  void watch();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
  bool armed_ = false;
  bool ending_ = false;
  double cpu_deadline_ = 0;
  Clock::time_point wall_deadline_;
  Finding finding_;
};

}  // namespace relign::conformance
