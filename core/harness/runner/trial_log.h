// The output of one trial's plugins, as written to logs/<trial id>.txt. A function of their output only: without times,
// and independent of the worker that ran the trial.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace relign::runner {

class TrialLog {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

  // on_text gets each piece that is kept, immediately; may be empty.
  explicit TrialLog(std::function<void(std::string_view)> on_text = {}) : on_text_(std::move(on_text)) {}

  // Lines are kept from here until take.
  void begin();
  // `level` as in relign_host::log; `who` is its source (empty: the trial's algorithm). Thread-safe.
  void add(int level, const std::string& who, const std::string& message);
  // Returns the log, with a last line on how much was cut; empty when there was no output.
  std::string take();

 private:
  std::function<void(std::string_view)> on_text_;
  std::mutex mutex_;
  bool open_ = false;
  std::string text_;
  std::uint64_t cut_lines_ = 0, cut_bytes_ = 0;
};

}  // namespace relign::runner
