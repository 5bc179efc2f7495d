#include "conformance/watchdog.h"

#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <string>

#include "base/json_source.h"
#include "conformance/progress.h"

namespace relign::conformance {
namespace {

int report_descriptor = STDOUT_FILENO;

double cpu_seconds_used() {
  timespec used{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

void write_line(const Json& entry) {
  // Messages of a plugin may contain invalid UTF-8.
  const std::string line = entry.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t count = ::write(report_descriptor, line.data() + written, line.size() - written);
    if (count <= 0) return;  // no reader; a check without a finding fails
    written += static_cast<std::size_t>(count);
  }
}

}  // namespace

void report_findings_to(int file_descriptor) { report_descriptor = file_descriptor; }

void report(const Finding& finding) {
  write_line({{"verdict", verdict_name(finding.verdict)}, {"reason", finding.sentence}});
}

void at(const std::string& where) { write_line({{"at", where}}); }

bool is_library(const plugin_host::Manifest& manifest) { return manifest.command.empty(); }

Watchdog::~Watchdog() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Watchdog::start(double cpu_seconds, double wall_seconds, Finding finding) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    cpu_deadline_ = cpu_seconds_used() + cpu_seconds;
    wall_deadline_ =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(wall_seconds));
    finding_ = std::move(finding);
    armed_ = true;
  }
  if (!thread_.joinable()) thread_ = std::thread([this] { watch(); });
}

void Watchdog::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  armed_ = false;
}

void Watchdog::watch() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ending_) {
    changed_.wait_for(lock, std::chrono::milliseconds(20));
    if (!armed_ || (cpu_seconds_used() < cpu_deadline_ && Clock::now() < wall_deadline_)) continue;
    report(finding_);
    ::_exit(0);
  }
}

}  // namespace relign::conformance
