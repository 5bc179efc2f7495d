// Ends a check whose plugin does not return: a call into a library cannot be interrupted, so that the process reports
// its finding and exits.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "conformance/finding.h"

namespace relign::conformance {

// Sets the file descriptor for findings of this process; without one they go to stdout as JSON.
void report_findings_to(int file_descriptor);
void report(const Finding& finding);

class Watchdog {
 public:
  Watchdog() = default;
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // After `cpu_seconds` of processor time of this process, or `wall_seconds`, reports `finding` and exits. Replaces an
  // earlier start.
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
