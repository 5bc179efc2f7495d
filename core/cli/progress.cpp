#include "cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "base/text.h"

namespace relign::cli {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kPlainInterval{10};
constexpr std::chrono::milliseconds kRepaintInterval{250};

bool stderr_is_terminal() { return isatty(STDERR_FILENO) == 1; }

bool terminal_can_repaint() {
  const char* term = std::getenv("TERM");
  return stderr_is_terminal() && term != nullptr && std::string(term) != "dumb";
}

double seconds_since(Clock::time_point moment) { return std::chrono::duration<double>(Clock::now() - moment).count(); }

std::string counts_text(const runner::Progress& progress, const std::string& counted) {
  if (progress.total == 0) return "";  // the trials are not known yet
  std::string text = ": " + std::to_string(progress.done) + " of " + std::to_string(progress.total) + " " + counted;
  if (progress.reused > 0) text += " (" + std::to_string(progress.reused) + " reused)";
  if (progress.failed > 0) text += ", " + std::to_string(progress.failed) + " failed";
  return text;
}

}  // namespace

std::optional<ProgressMode> progress_mode_from_name(const std::string& name) {
  if (name == "auto") return terminal_can_repaint() ? ProgressMode::line : ProgressMode::plain;
  if (name == "plain") return ProgressMode::plain;
  if (name == "json") return ProgressMode::json;
  if (name == "none") return ProgressMode::none;
  return std::nullopt;
}

bool stderr_has_colours() {
  const char* no_color = std::getenv("NO_COLOR");
  return terminal_can_repaint() && (no_color == nullptr || *no_color == '\0');
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long long>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole % 3600 / 60) + " min";
}

namespace {

struct Rounded {
  std::string number, unit;
};

// With the accuracy that an estimate has.
Rounded rounded(double seconds) {
  const auto to = [seconds](int step) { return step * std::llround(seconds / step); };
  if (seconds < 97.5) return {std::to_string(std::max(5LL, to(5))), "s"};
  if (seconds < 5970) return {std::to_string(to(60) / 60), "min"};
  return {significant(static_cast<double>(to(1800)) / 3600, 3), "h"};
}

}  // namespace

std::string time_left_text(const runner::Outlook& left) {
  if (left.most < 5) return "less than 5 s left";
  const Rounded about = rounded(left.seconds), least = rounded(left.least), most = rounded(left.most);
  constexpr double kWide = 1.8;
  if (left.most < kWide * std::max(left.least, 5.0)) return "about " + about.number + " " + about.unit + " left";
  return least.number + (least.unit == most.unit ? "" : " " + least.unit) + " to " + most.number + " " + most.unit +
         " left";
}

std::string trials_text(std::size_t count) { return std::to_string(count) + (count == 1 ? " trial" : " trials"); }

ProgressPrinter::ProgressPrinter(ProgressMode mode, const char* counted)
    : mode_(mode), counted_(counted), phase_since_(Clock::now()), last_printed_(Clock::now()) {
  if (mode_ != ProgressMode::none) ticker_ = std::thread([this] { tick(); });
}

ProgressPrinter::~ProgressPrinter() { finish(); }

void ProgressPrinter::update(const runner::Progress& progress) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (finished_) return;
  const bool new_phase = !started_ || progress.doing != last_phase_;
  if (new_phase) {
    last_phase_ = progress.doing;
    phase_since_ = Clock::now();
    done_at_phase_start_ = progress.done;
  }
  progress_ = progress;
  updated_ = Clock::now();
  started_ = true;
  if (new_phase && mode_ == ProgressMode::plain) print_plain();
  if (mode_ == ProgressMode::json && (new_phase || seconds_since(last_printed_) >= 1)) print_json();
}

void ProgressPrinter::message(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (painted_) std::fputs("\r\033[K", stderr);
  painted_ = false;
  if (mode_ == ProgressMode::json)
    print_line({{"message", text}});
  else
    std::fprintf(stderr, "%s\n", printable(text).c_str());
}

void ProgressPrinter::finish() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (finished_) return;
    finished_ = true;
    if (mode_ == ProgressMode::json && started_) print_json();
    if (painted_) std::fputs("\r\033[K", stderr);
    painted_ = false;
    std::fflush(stderr);
  }
  wake_.notify_all();
  if (ticker_.joinable()) ticker_.join();
}

// Repaints even if no trial ends, so that a long trial does not look like a hang.
void ProgressPrinter::tick() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!finished_) {
    wake_.wait_for(lock, kRepaintInterval);
    if (finished_ || !started_) continue;
    if (mode_ == ProgressMode::line) paint_line();
    if (mode_ == ProgressMode::plain && Clock::now() - last_printed_ >= kPlainInterval) print_plain();
  }
}

void ProgressPrinter::paint_line() {
  constexpr int kBarWidth = 24;
  const double share = progress_.total == 0 ? 0.0 : static_cast<double>(progress_.done) / progress_.total;
  const int filled = static_cast<int>(share * kBarWidth);
  const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '.');
  std::string text = "[" + bar + "] " + progress_.doing + counts_text(progress_, counted_);
  text += outlook_text();
  std::fprintf(stderr, "\r\033[K%s", text.c_str());
  std::fflush(stderr);
  painted_ = true;
}

// Rate of this phase; 0 until there is an estimate.
double ProgressPrinter::per_second() const {
  constexpr std::size_t kMinForEstimate = 3;
  const std::size_t done_here = progress_.done - std::min(progress_.done, done_at_phase_start_);
  const double elapsed = seconds_since(phase_since_);
  return done_here >= kMinForEstimate && elapsed > 0 ? static_cast<double>(done_here) / elapsed : 0;
}

// The caller's estimate, or without one an estimate by the rate.
std::optional<runner::Outlook> ProgressPrinter::left() const {
  runner::Outlook left;
  if (progress_.estimates) {
    if (!progress_.left) return std::nullopt;
    left = *progress_.left;
    const double passed = seconds_since(updated_);
    for (double* of : {&left.seconds, &left.least, &left.most}) *of = std::max(0.0, *of - passed);
    return left;
  }
  const double rate = per_second();
  if (rate <= 0) return std::nullopt;
  left.seconds = left.least = left.most = static_cast<double>(progress_.total - progress_.done) / rate;
  return left;
}

std::string ProgressPrinter::outlook_text() const {
  if (progress_.done >= progress_.total) return "";
  if (const std::optional<runner::Outlook> outlook = left()) return ", " + time_left_text(*outlook);
  return progress_.estimates ? ", measuring the time left" : "";
}

void ProgressPrinter::print_plain() {
  std::fprintf(stderr, "%s%s, %s%s\n", progress_.doing.c_str(), counts_text(progress_, counted_).c_str(),
               duration_text(std::max(progress_.seconds, seconds_since(phase_since_))).c_str(), outlook_text().c_str());
  std::fflush(stderr);
  last_printed_ = Clock::now();
}

void ProgressPrinter::print_line(const nlohmann::json& line) {
  std::fprintf(stderr, "%s\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  std::fflush(stderr);
}

void ProgressPrinter::print_json() {
  const double rate = per_second();
  nlohmann::json line = {{"doing", progress_.doing},   {"done", progress_.done},     {"total", progress_.total},
                         {"failed", progress_.failed}, {"reused", progress_.reused}, {"seconds", progress_.seconds},
                         {"per_second", nullptr},      {"seconds_left", nullptr},    {"seconds_left_range", nullptr}};
  if (rate > 0) line["per_second"] = rate;
  if (const std::optional<runner::Outlook> outlook = left()) {
    line["seconds_left"] = outlook->seconds;
    if (progress_.estimates) line["seconds_left_range"] = {outlook->least, outlook->most};
  }
  print_line(line);
  last_printed_ = Clock::now();
}

}  // namespace relign::cli
