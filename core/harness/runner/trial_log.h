// What the plugins of one trial print and log, as it will stand in logs/<trial id>.txt. A function of their output
// only: no times, and nothing that depends on which worker the trial ran on.
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
  static constexpr std::size_t kMostBytes = std::size_t{1} << 20;

  // on_text gets each piece that stays, as soon as it is said; may be empty.
  explicit TrialLog(std::function<void(std::string_view)> on_text = {}) : on_text_(std::move(on_text)) {}

  // Lines count from here on; before, and after take, they are nobody's.
  void begin();
  // `level` as in relign_host::log, `who` said it (empty: the trial's algorithm). Any thread.
  void add(int level, const std::string& who, const std::string& message);
  // All of it, with a closing line that says how much was cut; empty when nothing was said.
  std::string take();

 private:
  std::function<void(std::string_view)> on_text_;
  std::mutex mutex_;
  bool open_ = false;
  std::string text_;
  std::uint64_t cut_lines_ = 0, cut_bytes_ = 0;
};

}  // namespace relign::runner
