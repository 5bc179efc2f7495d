// Prints the progress of a run to stderr: one repainted line on a terminal, a plain line every 10 seconds
// elsewhere, JSON lines for programs, or nothing. A JSON line is {"doing", "done", "total", "failed",
// "reused", "seconds", "per_second", "seconds_left", "seconds_left_range"}, the last three null until there is
// an estimate, or {"message"}. The range, of two numbers, is null for work without a range.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <thread>

#include "runner/run.h"

namespace relign::cli {

enum class ProgressMode { line, plain, json, none };

// "auto" is `line` on a terminal that can repaint, otherwise `plain`.
std::optional<ProgressMode> progress_mode_from_name(const std::string& name);

// True if stderr is a terminal and NO_COLOR is not set.
bool stderr_has_colours();

class ProgressPrinter {
 public:
  // `counted`: the unit of progress, in the plural.
  explicit ProgressPrinter(ProgressMode mode, const char* counted = "trials");
  ~ProgressPrinter();
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void update(const runner::Progress& progress);  // any thread
  void message(const std::string& text);          // a permanent line; any thread
  void finish();                                  // clears the repainted line; may be called again

 private:
  void tick();
  void paint_line();
  void print_plain();
  void print_json();
  static void print_line(const nlohmann::json& line);
  double per_second() const;
  std::optional<runner::Outlook> left() const;
  std::string outlook_text() const;

  const ProgressMode mode_;
  const std::string counted_;
  std::mutex mutex_;
  std::condition_variable wake_;
  runner::Progress progress_;
  std::string last_phase_;
  std::chrono::steady_clock::time_point phase_since_;
  std::chrono::steady_clock::time_point updated_;
  std::chrono::steady_clock::time_point last_printed_;
  std::size_t done_at_phase_start_ = 0;
  bool started_ = false;
  bool painted_ = false;
  bool finished_ = false;
  std::thread ticker_;
};

// "12 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

// A rounded time that is left: "about 40 s left", "1 to 4 min left", "less than 5 s left".
std::string time_left_text(const runner::Outlook& left);

// "1 trial", "2 trials".
std::string trials_text(std::size_t count);

}  // namespace relign::cli
