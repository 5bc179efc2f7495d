#include "records/instance_checks.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "records/difference.h"

namespace relign::records {
namespace {

constexpr double kOtherCpu = 1e-6;  // relative: numbers are bit-identical on one type of processor only

// A trial begins at a pose that the noise level draws, so that the largest standard errors of trials are alike, except
// where most starts are dark; errors that small hide nothing.
constexpr double kMostTimesMedian = 30, kSmallError = 1e-5;

bool differ(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) != std::isnan(b);
  return std::abs(a - b) > kOtherCpu * std::abs(a);
}

bool differ(const std::vector<double>& a, const std::vector<double>& b) {
  return !std::equal(a.begin(), a.end(), b.begin(), b.end(), [](double x, double y) {
    return std::isnan(x) || std::isnan(y) ? std::isnan(x) == std::isnan(y) : std::abs(x - y) <= kOtherCpu;
  });
}

std::string sentence(const std::string& trial, std::size_t others, const std::string& column, bool has) {
  return trial + (has ? " has " : " lacks ") + in_quotes(column) + ", which " + counted(others, "other trial") +
         " on this scene and noise level " + (has ? (others == 1 ? "lacks" : "lack") : (others == 1 ? "has" : "have"));
}

}  // namespace

std::string InstanceChecks::add(const TrialRecord& closing, const std::vector<StepNumbers>& steps) {
  std::string what;
  if (!steps.empty() && steps.front().step == 0) what = check_start(closing, steps.front());
  if (what.empty()) what = check_optimum(closing);
  if (ended_well(closing.end)) count_scores(closing);
  Uncertainty largest = {0, label_of(closing)};
  for (const StepNumbers& step : steps)
    for (const double error : {step.commanded_mse_error, step.recommended_mse_error})
      largest.error = std::max(largest.error, error);  // not NaN
  if (largest.error > 0) errors_[{closing.scene, closing.noise_level}].push_back(std::move(largest));
  return what;
}

std::string InstanceChecks::check_start(const TrialRecord& closing, const StepNumbers& first) {
  const auto [known, is_new] =
      starts_.try_emplace({closing.scene, closing.noise_level, closing.protocol, closing.instance},
                          Start{label_of(closing), first.true_pose, first.regions.empty() ? first.measured : kUnknown,
                                first.commanded_mse});
  if (is_new) return "";
  const Start& other = known->second;
  const char* what = differ(other.true_pose, first.true_pose) ? "true_pose"
                     : differ(other.measured, first.measured) ? "measured"
                     : differ(other.mse, first.commanded_mse) ? "commanded_mse"
                                                              : nullptr;
  return what ? "starts with another " + in_quotes(what) + " than " + other.trial + ", although it is the same start"
              : "";
}

std::string InstanceChecks::check_optimum(const TrialRecord& closing) {
  const OwnOptimum& own = closing.own_optimum;
  if (std::isnan(own.mse)) return "";
  const auto [known, is_new] = optima_.try_emplace({closing.scene, closing.noise_level, "", closing.instance},
                                                   Optimum{label_of(closing), own.mse, own.pose});
  if (is_new) return "";
  const bool poses = !several_processors_ && differ(known->second.pose, own.pose);
  if (!poses && !differ(known->second.mse, own.mse)) return "";
  return "has another " + in_quotes(poses ? "own_optimum_pose" : "own_optimum_mse") + " than " + known->second.trial +
         ", although it is the same lens";
}

void InstanceChecks::count_scores(const TrialRecord& closing) {
  const auto count = [&closing](auto& columns, const std::string& column, bool has) {
    Presence& presence = columns[{closing.scene, closing.noise_level, column}];
    const std::string method = closing.algorithm + "\n" + closing.protocol;
    presence.methods.insert(method);
    if (has) presence.methods_with.insert(method);
    std::string& one = has ? presence.one_with : presence.one_without;
    ++(has ? presence.with : presence.without);
    if (one.empty()) one = "trial " + closing.trial + " (" + label_of(closing) + ")";
  };
  trial_columns(
      [&](const Column& column, const auto& value) {
        if (column.key == "own_optimum_mse") count(all_, "own_optimum_mse", is_known(value));
        if (several_terms_ || !column.is(kOptional) || column.key == "method" || column.key == "training") return;
        const bool may_be_unknown = column.is(kShare) || column.key.substr(0, 18) == "criterion_optimum_";
        count(may_be_unknown ? some_ : all_, std::string(column.key), is_known(value));
      },
      closing);
}

std::vector<std::string> InstanceChecks::findings() const {
  std::vector<std::string> found;
  for (const auto& [key, presence] : all_) {
    if (presence.with == 0 || presence.without == 0) continue;
    const bool has = presence.with < presence.without;
    found.push_back(sentence(has ? presence.one_with : presence.one_without, has ? presence.without : presence.with,
                             std::get<2>(key), has));
  }
  for (const auto& [key, trials] : errors_) {
    std::vector<double> errors;
    for (const Uncertainty& one : trials) errors.push_back(one.error);
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    const double median = errors[errors.size() / 2];
    for (const Uncertainty& one : trials)
      if (one.error > std::max(kSmallError, kMostTimesMedian * median))
        found.push_back(one.trial + " has the standard error " + shortest(one.error) +
                        " of an MSE, that of other trials is " + shortest(median));
  }
  for (const auto& [key, presence] : some_)
    if (!presence.methods_with.empty() && presence.methods_with.size() * 2 < presence.methods.size())
      found.push_back(presence.one_with + " has " + in_quotes(std::get<2>(key)) +
                      ", which most methods on this scene and noise level lack");
  return found;
}

}  // namespace relign::records
