#include "runner/trial_log.h"

#include <utility>

#include "plugin_host/confinement.h"

namespace relign::runner {

void TrialLog::begin() {
  const std::lock_guard<std::mutex> hold(mutex_);
  open_ = true;
  text_.clear();
  cut_lines_ = cut_bytes_ = 0;
}

void TrialLog::add(int level, const std::string& who, const std::string& message) {
  std::string line(plugin_host::log_prefix(level));
  line += (who.empty() ? "" : who + ": ") + message + "\n";
  const std::lock_guard<std::mutex> hold(mutex_);
  if (!open_) return;
  // After the first cut everything is cut, so that the log has no gaps.
  if (cut_lines_ == 0 && text_.size() + line.size() <= kMaxBytes) {
    text_ += line;
    if (on_text_) on_text_(line);
  } else {
    ++cut_lines_;
    cut_bytes_ += line.size();
  }
}

std::string TrialLog::take() {
  const std::lock_guard<std::mutex> hold(mutex_);
  open_ = false;
  if (cut_lines_ > 0) {
    const std::string cut = "(cut here: " + std::to_string(cut_lines_) +
                            (cut_lines_ == 1 ? " more line, " : " more lines, ") + std::to_string(cut_bytes_) +
                            " bytes)\n";
    text_ += cut;
    if (on_text_) on_text_(cut);
  }
  return std::exchange(text_, {});
}

}  // namespace relign::runner
