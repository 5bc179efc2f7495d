#include "records/difference.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/json_source.h"
#include "base/text.h"

namespace relign::records {
namespace {

std::string written(double value) {
  if (!std::isfinite(value)) return "null";
  return value == 0 && std::signbit(value) ? "-0.0" : shortest(value);
}

// Files have a replacement for invalid UTF-8; here, too.
std::string as_written(const Json& value) {
  const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return value.is_string() ? text.substr(1, text.size() - 2) : text;
}

bool same_bits(double a, double b) {
  // Files have null for every non-finite number.
  if (!std::isfinite(a) || !std::isfinite(b)) return std::isfinite(a) == std::isfinite(b);
  return std::memcmp(&a, &b, sizeof a) == 0;
}

// Gets each pair of values of two records, in the order of their lines, and keeps the first and the largest difference.
class Comparison {
 public:
  explicit Comparison(double tolerance) : tolerance_(tolerance) {}

  std::optional<Difference> first;
  double largest = 0;

  void at_step(unsigned step) { step_ = step; }
  void at_closing() { closing_ = true; }

  void operator()(const Column& column, double was, double is) { number(std::string(column.key), was, is); }
  void operator()(const Column& column, const std::vector<double>& was, const std::vector<double>& is) {
    const std::string key(column.key);
    if (was.size() != is.size()) return text(key + " (length)", std::to_string(was.size()), std::to_string(is.size()));
    for (std::size_t i = 0; i < was.size(); ++i) number(key + "[" + std::to_string(i) + "]", was[i], is[i]);
  }
  void operator()(const Column& column, const PixelRegions& was, const PixelRegions& is) {
    text(std::string(column.key), to_json_text(was), to_json_text(is));
  }
  void operator()(const Column& column, std::uint64_t was, std::uint64_t is) {
    text(std::string(column.key), std::to_string(was), std::to_string(is));
  }
  template <class Text>  // or a list of them
  void operator()(const Column& column, const Text& was, const Text& is) {
    text(std::string(column.key), as_written(was), as_written(is));
  }
  void text(const std::string& field, const std::string& was, const std::string& is) {
    if (was != is) keep(field, was, is, std::numeric_limits<double>::infinity());
  }

 private:
  void number(const std::string& field, double was, double is) {
    if (same_bits(was, is)) return;
    const bool both = std::isfinite(was) && std::isfinite(is);
    const double size = both ? std::abs(is - was) : std::numeric_limits<double>::infinity();
    const double scale = 1 + (both ? std::abs(was) : 0);
    largest = std::max(largest, size / scale);
    if (tolerance_ > 0 && size <= tolerance_ * scale) return;
    keep(field, written(was), written(is), size);
  }
  void keep(const std::string& field, const std::string& was, const std::string& is, double size) {
    if (!first) first = Difference{closing_, step_, field, was, is, size};
  }
  double tolerance_;
  unsigned step_ = 0;
  bool closing_ = false;
};

Comparison compare(const TrialRecord& was, const TrialRecord& is, double tolerance) {
  Comparison comparison(tolerance);
  const std::size_t common = std::min(was.steps.size(), is.steps.size());
  for (std::size_t index = 0; index < common; ++index) {
    comparison.at_step(was.steps[index].step);
    step_columns(comparison, was.steps[index], is.steps[index]);
  }
  comparison.at_closing();
  comparison.text("trial", was.trial, is.trial);
  comparison.text("end", was.end, is.end);
  comparison.text("steps", std::to_string(was.steps.size()), std::to_string(is.steps.size()));
  trial_columns(comparison, was, is);
  return comparison;
}

}  // namespace

std::string to_string(const Difference& difference) {
  const std::string place = difference.closing ? "closing line" : "step " + std::to_string(difference.step);
  return place + ", " + difference.field + ": was " + difference.was + ", is " + difference.is;
}

std::optional<Difference> first_difference(const TrialRecord& was, const TrialRecord& is, double tolerance) {
  return compare(was, is, tolerance).first;
}

double largest_difference(const TrialRecord& was, const TrialRecord& is) { return compare(was, is, 0).largest; }

std::set<std::string> clear_later(const TrialRecord& older, TrialRecord& newer) {
  LaterColumns later;
  const auto add = [&later](const Column& column, const auto& value) { later.add(column, value); };
  const auto clear = [&later](const Column& column, auto& value) { later.clear(column, value); };
  for (const StepRecord& step : older.steps) step_columns(add, step);
  trial_columns(add, older);
  for (StepRecord& step : newer.steps) step_columns(clear, step);
  trial_columns(clear, newer);
  return later.cleared();
}

std::string to_string(const NotCompared& columns) {
  std::vector<std::string> parts;
  for (const auto& [key, trials] : columns) parts.push_back(in_quotes(key) + " of " + counted(trials, "trial"));
  return join(parts, ", ");
}

std::string label_of(const TrialRecord& trial) {
  return trial.algorithm + " on " + trial.scene + " " + trial.noise_level + " #" + std::to_string(trial.instance);
}

}  // namespace relign::records
