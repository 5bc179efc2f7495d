#include "records/compare.h"

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

  void number(const std::string& field, double was, double is) {
    if (same_bits(was, is)) return;
    const bool both = std::isfinite(was) && std::isfinite(is);
    const double size = both ? std::abs(is - was) : std::numeric_limits<double>::infinity();
    const double scale = 1 + (both ? std::abs(was) : 0);
    largest = std::max(largest, size / scale);
    if (tolerance_ > 0 && size <= tolerance_ * scale) return;
    keep(field, written(was), written(is), size);
  }
  void numbers(const std::string& field, const std::vector<double>& was, const std::vector<double>& is) {
    if (was.size() != is.size())
      return text(field + " (length)", std::to_string(was.size()), std::to_string(is.size()));
    for (std::size_t axis = 0; axis < was.size(); ++axis)
      number(field + "[" + std::to_string(axis) + "]", was[axis], is[axis]);
  }
  void text(const std::string& field, const std::string& was, const std::string& is) {
    if (was != is) keep(field, was, is, std::numeric_limits<double>::infinity());
  }
  void count(const std::string& field, std::uint64_t was, std::uint64_t is) {
    text(field, std::to_string(was), std::to_string(is));
  }

 private:
  void keep(const std::string& field, const std::string& was, const std::string& is, double size) {
    if (!first) first = Difference{closing_, step_, field, was, is, size};
  }
  double tolerance_;
  unsigned step_ = 0;
  bool closing_ = false;
};

void compare_step(const StepRecord& was, const StepRecord& is, Comparison& comparison) {
  comparison.at_step(was.step);
  comparison.count("step", was.step, is.step);
  comparison.numbers("commanded_pose", was.commanded_pose, is.commanded_pose);
  comparison.numbers("true_pose", was.true_pose, is.true_pose);
  comparison.count("limits_low", was.limits_low, is.limits_low);
  comparison.count("limits_high", was.limits_high, is.limits_high);
  comparison.number("merit", was.merit, is.merit);
  comparison.number("measured", was.measured, is.measured);
  if (was.regions != is.regions) comparison.text("regions", to_json_text(was.regions), to_json_text(is.regions));
  comparison.number("machine_seconds", was.machine_seconds, is.machine_seconds);
  comparison.numbers("recommended_pose", was.recommended_pose, is.recommended_pose);
  comparison.text("recommendation", was.recommendation, is.recommendation);
  comparison.number("recommended_seconds", was.recommended_seconds, is.recommended_seconds);
  comparison.numbers("recommended_true_pose", was.recommended_true_pose, is.recommended_true_pose);
  comparison.number("commanded_mse", was.commanded_mse, is.commanded_mse);
  comparison.number("commanded_mse_error", was.commanded_mse_error, is.commanded_mse_error);
  comparison.number("recommended_mse", was.recommended_mse, is.recommended_mse);
  comparison.number("recommended_mse_error", was.recommended_mse_error, is.recommended_mse_error);
}

void compare_closing(const TrialRecord& was, const TrialRecord& is, Comparison& comparison) {
  comparison.at_closing();
  comparison.text("trial", was.trial, is.trial);
  comparison.text("end", was.end, is.end);
  comparison.count("steps", was.steps.size(), is.steps.size());
  comparison.count("budget", was.budget, is.budget);
  comparison.text("scene", was.scene, is.scene);
  comparison.text("noise_level", was.noise_level, is.noise_level);
  comparison.text("protocol", was.protocol, is.protocol);
  comparison.text("algorithm", was.algorithm, is.algorithm);
  comparison.text("algorithm_id", was.algorithm_id, is.algorithm_id);
  comparison.count("instance", was.instance, is.instance);
  comparison.count("instance_seed", was.instance_seed, is.instance_seed);
  const double none = std::numeric_limits<double>::quiet_NaN();
  comparison.number("own_optimum_mse", was.has_own_optimum ? was.own_optimum_mse : none,
                    is.has_own_optimum ? is.own_optimum_mse : none);
  comparison.numbers("own_optimum_pose", was.own_optimum_pose, is.own_optimum_pose);
  comparison.number("uncured_mse", was.uncured_mse, is.uncured_mse);
  const auto mtf = [&comparison](const char* centre, const char* corner, const MtfRecord& a, const MtfRecord& b) {
    comparison.number(centre, a.centre, b.centre);
    comparison.number(corner, a.corner, b.corner);
  };
  mtf("mtf_centre", "mtf_corner", was.mtf, is.mtf);
  mtf("uncured_mtf_centre", "uncured_mtf_corner", was.uncured_mtf, is.uncured_mtf);
  mtf("own_optimum_mtf_centre", "own_optimum_mtf_corner", was.own_optimum_mtf, is.own_optimum_mtf);
  comparison.numbers("glued_mse", was.glued_mse, is.glued_mse);
  comparison.numbers("glued_mse_error", was.glued_mse_error, is.glued_mse_error);
  comparison.numbers("best_mse", was.best_mse, is.best_mse);
  comparison.numbers("best_mse_error", was.best_mse_error, is.best_mse_error);
  comparison.number("best_uncured_mse", was.best_uncured_mse, is.best_uncured_mse);
  mtf("best_mtf_centre", "best_mtf_corner", was.best_mtf, is.best_mtf);
  mtf("best_uncured_mtf_centre", "best_uncured_mtf_corner", was.best_uncured_mtf, is.best_uncured_mtf);
  mtf("current_mtf_centre", "current_mtf_corner", was.current_mtf, is.current_mtf);
  mtf("current_uncured_mtf_centre", "current_uncured_mtf_corner", was.current_uncured_mtf, is.current_uncured_mtf);
  for (const Criterion criterion : kCriteria)
    comparison.numbers(criterion_name(criterion), was.criteria[criterion], is.criteria[criterion]);
  comparison.numbers("criterion_optimum_pose", was.criterion_optimum_pose, is.criterion_optimum_pose);
  comparison.number("criterion_optimum_deficit", was.criterion_optimum_deficit, is.criterion_optimum_deficit);
  // Files have a replacement for invalid UTF-8; here, too.
  const auto as_written = [](const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); };
  comparison.text("message", as_written(was.message), as_written(is.message));
  comparison.text("warnings", as_written(was.warnings), as_written(is.warnings));
}

Comparison compare(const TrialRecord& was, const TrialRecord& is, double tolerance) {
  Comparison comparison(tolerance);
  const std::size_t common = std::min(was.steps.size(), is.steps.size());
  for (std::size_t index = 0; index < common; ++index) compare_step(was.steps[index], is.steps[index], comparison);
  compare_closing(was, is, comparison);
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

std::string label_of(const TrialRecord& trial) {
  return trial.algorithm + " on " + trial.scene + " " + trial.noise_level + " #" + std::to_string(trial.instance);
}

}  // namespace relign::records
