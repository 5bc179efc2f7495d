#include "records/score_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

#include "base/text.h"

namespace relign::records {
namespace {

constexpr double kSlack = 1e-9;  // rounding of a sum, relative
// Pixels are from 0 to 1. Noise-free errors are signed estimates; of a dim scene of few rays they may be some 1e-4
// below 0.
constexpr double kLowestMse = -1e-2, kHighestMse = 1;
// Of other scores, whose values are from 0 in any unit.
constexpr double kHighestScore = std::numeric_limits<double>::max();
// How far an estimate may be below what it estimates: standard errors, themselves estimates of few samples, and an MSE.
constexpr double kStandardErrors = 10, kNoise = 1e-5;
constexpr double kMostSeconds = 1e9;  // 30 years
constexpr double kShareBelow = 0.1;   // of an instance's own optimum, which is the result of a search

struct Mse {
  double mse, error;
};

std::string number_text(double number) { return std::isnan(number) ? "null" : shortest(number); }

struct Bounds {
  explicit Bounds(const ScoreTerms& terms)
      : lowest(terms.squared ? kLowestMse : -kHighestScore),
        highest(terms.squared ? kHighestMse : kHighestScore),
        noise(terms.squared ? kNoise : terms.resolution),
        what(terms.squared ? "a mean squared error is from 0 to " + shortest(kHighestMse) : "a score is from 0") {}
  bool contain(double value) const { return value >= lowest && value <= highest; }

  double lowest, highest, noise;
  std::string what;
};

// As the end of "has 'commanded_mse' 3 at step 2 with the standard error 1e-7"; empty: a value that can be.
std::string flaw_of(const Mse& value, const Bounds& bounds) {
  if (!bounds.contain(value.mse)) return "; " + bounds.what;
  if (!(value.error >= 0 && value.error <= bounds.highest))
    return " with the standard error " + number_text(value.error);
  if (value.mse < -std::max(bounds.noise, kStandardErrors * value.error))
    return ", which is below 0 by more than " + shortest(kStandardErrors) + " standard errors";
  return "";
}

std::string below(const Mse& value, double optimum, const Bounds& bounds) {
  const double margin = std::max({bounds.noise, kShareBelow * optimum, kStandardErrors * value.error});
  return optimum - std::max(value.mse, 0.0) > margin ? ", clearly below 'own_optimum_mse' " + shortest(optimum) : "";
}

std::string flaw_of_pose(const std::vector<double>& pose, std::size_t axes, bool of_lens, bool may_be_unknown) {
  if (pose.size() != axes) return "of " + std::to_string(pose.size()) + " instead of " + std::to_string(axes) + " axes";
  if (!may_be_unknown && std::any_of(pose.begin(), pose.end(), [](double at) { return std::isnan(at); }))
    return "with an unknown value";
  const auto outside = [](double at) { return at < -kSlack || at > 1 + kSlack; };  // false for NaN
  if (of_lens && std::any_of(pose.begin(), pose.end(), outside)) return "outside the travel";
  return "";
}

std::string out_of_range(const char* what, double seconds) {
  return "has " + in_quotes(what) + " " + shortest(seconds) + ", which is not from 0 to " + shortest(kMostSeconds) +
         " s";
}

std::string at(const StepNumbers& step) { return " at step " + std::to_string(step.step); }

std::string flaw_of_poses(const StepNumbers& step, const ScoreTerms& terms) {
  for (const auto& [pose, what, of_lens] : {std::tuple(&step.commanded_pose, "commanded_pose", false),
                                            {&step.true_pose, "true_pose", true},
                                            {&step.recommended_pose, "recommended_pose", false},
                                            {&step.recommended_true_pose, "recommended_true_pose", true}})
    if (const std::string flaw = flaw_of_pose(*pose, terms.axes, of_lens, of_lens && terms.station); !flaw.empty())
      return "has " + in_quotes(what) + " " + flaw + at(step);
  if ((step.limits_low & step.limits_high) != 0) return "is at both limits of an axis" + at(step);
  if (step.step == 0 && !terms.station && (step.limits_low | step.limits_high) != 0)
    return "starts at a limit" + at(step);
  if (terms.axes < 64 && ((step.limits_low | step.limits_high) >> terms.axes) != 0)
    return "is at a limit of an axis that its scene does not have" + at(step);
  return "";
}

bool same_pose(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return std::abs(x - y) <= kSlack || std::isnan(x) || std::isnan(y); });
}

// Two estimates of the error at the same true pose. Of few samples a standard error may be too small by chance.
bool agree(const Mse& a, const Mse& b, const Bounds& bounds) {
  constexpr double kApart = 0.05;
  const double noise = std::max(bounds.noise, kStandardErrors * std::hypot(a.error, b.error));
  return !(std::abs(a.mse - b.mse) > noise + kApart * std::abs(b.mse));
}

// `best`: the step of the lowest merit so far. `repeats`: a command always leads to the same pose.
std::string flaw_of_recommendation(const StepNumbers& step, const StepNumbers& best, bool repeats,
                                   const Bounds& bounds) {
  for (const StepNumbers* other : {&step, &best})
    if (other->true_pose == step.recommended_true_pose &&
        !agree({step.recommended_mse, step.recommended_mse_error}, {other->commanded_mse, other->commanded_mse_error},
               bounds))
      return "has 'recommended_mse' " + shortest(step.recommended_mse) + at(step) + ", but 'commanded_mse' " +
             shortest(other->commanded_mse) + at(*other) + " at the same true pose";
  if (step.recommendation == "own") return "";
  if (step.recommendation != "best_measured" && step.recommendation != "current")
    return "has the recommendation " + in_quotes(step.recommendation) + at(step);
  const StepNumbers& named = step.recommendation == "current" ? step : best;
  const bool moves = repeats && named.limits_low == 0 && named.limits_high == 0;
  if (step.recommended_pose == named.commanded_pose &&
      (!moves || same_pose(step.recommended_true_pose, named.true_pose)))
    return "";
  return "has the recommendation " + in_quotes(step.recommendation) + at(step) + ", but recommends another pose";
}

std::array<std::pair<Mse, const char*>, 2> errors_of(const StepNumbers& step) {
  return {{{{step.commanded_mse, step.commanded_mse_error}, "commanded_mse"},
           {{step.recommended_mse, step.recommended_mse_error}, "recommended_mse"}}};
}

// The measured score; of images an RMSE, or the sum of one and the distance to the nominal pose, or a merit by field,
// from 0 to 1.
std::string flaw_of_merit(const StepNumbers& step, const ScoreTerms& terms) {
  const auto flaw = [&step](const std::string& why) {
    return "has 'merit' " + number_text(step.merit) + at(step) + why;
  };
  const double most = 1 + (terms.merit_has_rmse ? std::sqrt(static_cast<double>(terms.axes)) : 0);
  if (terms.squared && step.merit < 0) return flaw(", below 0");
  if (std::isnan(step.merit) || (terms.squared && step.merit > most * (1 + kSlack)))
    return flaw("; a merit is a number from 0 to " + shortest(most));
  const double slack = kSlack * std::abs(step.measured);
  if (terms.merit_has_rmse && step.merit < step.measured - slack)
    return flaw(", below the measured error, which it includes");
  if (terms.merit_is_rmse && step.merit > step.measured + slack)
    return flaw(", but it is the measured error, " + shortest(step.measured));
  return "";
}

std::string flaw_of_step(const StepNumbers& step, const StepNumbers* before, const ScoreTerms& terms,
                         const Bounds& bounds) {
  for (const auto& [value, what] : errors_of(step)) {
    if (terms.has_truth && std::isnan(value.mse)) return "lacks " + in_quotes(what) + at(step);
    if (terms.known && !terms.has_truth && !std::isnan(value.mse))
      return "has " + in_quotes(what) + at(step) + ", but its scene has no ground truth";
    if (std::isnan(value.mse)) continue;
    if (const std::string flaw = flaw_of(value, bounds); !flaw.empty())
      return "has " + in_quotes(what) + " " + shortest(value.mse) + at(step) + flaw;
  }
  if (terms.known && std::isnan(step.measured) == step.regions.empty())
    return (step.regions.empty() ? "lacks 'measured'" : "has 'measured' of an image of regions") + at(step);
  if (terms.squared && (step.measured < 0 || step.measured * step.measured > kHighestMse))
    return "has 'measured' " + shortest(step.measured) + at(step);
  if (const std::string flaw = flaw_of_merit(step, terms); !flaw.empty()) return flaw;
  const double clock = before ? before->machine_seconds : 0;
  if (!(step.machine_seconds >= clock * (1 - kSlack)))
    return "has 'machine_seconds' " + number_text(step.machine_seconds) + at(step) + " after " + shortest(clock);
  for (const auto& [seconds, what] :
       {std::pair(step.machine_seconds, "machine_seconds"), {step.recommended_seconds, "recommended_seconds"}})
    if (seconds > kMostSeconds) return out_of_range(what, seconds) + at(step);
  if (before && !terms.station && step.machine_seconds - clock < terms.step_seconds * (1 - kSlack) - kSlack * clock)
    return "has 'machine_seconds' " + shortest(step.machine_seconds) + at(step) + " after " + shortest(clock) +
           ", but a step takes at least " + shortest(terms.step_seconds);
  if (!(step.recommended_seconds >= step.machine_seconds * (1 - kSlack)) &&
      !(terms.station && std::isnan(step.recommended_seconds)))
    return "has 'recommended_seconds' " + number_text(step.recommended_seconds) + at(step) +
           "; the move to the recommendation begins at " + shortest(step.machine_seconds);
  return flaw_of_poses(step, terms);
}

// One value per step, of a rule.
std::string flaw_of_errors(const StepErrors& errors, const char* what, double optimum, const Bounds& bounds) {
  for (std::size_t i = 0; i < errors.mse.size(); ++i) {
    const Mse value = {errors.mse[i], i < errors.error.size() ? errors.error[i] : kUnknown};
    const std::string flaw = flaw_of(value, bounds) + below(value, optimum, bounds);
    if (!flaw.empty())
      return "has " + in_quotes(what) + " " + shortest(value.mse) + " at step " + std::to_string(i) + flaw;
  }
  return "";
}

// Distances are not below 0. By how much the MTF of a field is below its limit is a difference of two numbers from 0
// to 1. NaN: not measurable.
std::string flaw_of_criteria(const TrialRecord& closing) {
  constexpr double kMostDistance = 1e9;
  for (const Criterion criterion : kCriteria) {
    const bool mtf = criterion == Criterion::field_mtf;
    const double least = mtf ? -1 : 0;
    const double most = mtf ? 1 : is_further_score(criterion) ? std::numeric_limits<double>::max() : kMostDistance;
    const std::vector<double>& values = closing.criteria[criterion];
    for (std::size_t i = 0; i < values.size(); ++i)
      if (values[i] < least || values[i] > most)
        return "has " + in_quotes(std::string(entry_of(criterion).column)) + " " + shortest(values[i]) + " at step " +
               std::to_string(i) + "; it is from " + shortest(least) + " to " + shortest(most);
  }
  std::size_t further = 0;
  for (std::size_t i = 0; i < kMostFurtherScores; ++i) {
    const std::vector<double>& values = closing.criteria[further_score(i)];
    further += !values.empty();
    if (std::any_of(values.begin(), values.end(), [](double value) { return std::isnan(value); }))
      return "lacks a value of " + in_quotes(std::string(entry_of(further_score(i)).column));
  }
  const std::vector<double>& there = closing.own_optimum.further_scores;
  const bool impossible = std::any_of(there.begin(), there.end(), [](double value) { return !(value >= 0); });
  if (impossible || (!there.empty() && there.size() != further))
    return "has " + std::to_string(there.size()) + " 'own_optimum_further_scores', " +
           (impossible ? "one of which is unknown or below 0" : "but " + std::to_string(further) + " of its steps");
  return std::abs(closing.criterion_optimum_deficit) > 1
             ? "has 'criterion_optimum_deficit' " + shortest(closing.criterion_optimum_deficit) + "; it is from -1 to 1"
             : "";
}

}  // namespace

std::string flaw_of_times(const TrialTimes& times) {
  for (const auto& [values, what] : {std::pair(&times.algorithm_seconds, "algorithm_seconds"),
                                     {&times.simulation_seconds, "simulation_seconds"},
                                     {&times.truth_seconds, "truth_seconds"}})
    for (const double seconds : *values)
      if (seconds < 0 || seconds > kMostSeconds) return out_of_range(what, seconds);
  const double harness = times.harness_seconds;
  return harness < 0 || harness > kMostSeconds ? out_of_range("harness_seconds", harness) : "";
}

std::string flaw_of_scores(const TrialRecord& closing, const std::vector<StepNumbers>& steps, const ScoreTerms& terms) {
  const double optimum = closing.own_optimum.mse;
  const Bounds bounds(terms);
  const StepNumbers* before = nullptr;
  const StepNumbers* best = nullptr;
  // A trial that failed has no scores from which this could be seen.
  const bool repeats = ended_well(closing.end) && !terms.station && std::isnan(closing.scores.uncured_mse[Rule::own]) &&
                       closing.scores.by_step[Rule::best].mse.empty();
  double lowest = std::numeric_limits<double>::infinity();
  for (const StepNumbers& step : steps) {
    if (step.regions.empty() && step.merit < lowest) {
      lowest = step.merit;
      best = &step;
    }
    std::string flaw = flaw_of_step(step, before, terms, bounds);
    if (flaw.empty() && best) flaw = flaw_of_recommendation(step, *best, repeats, bounds);
    if (!flaw.empty()) return flaw;
    for (const auto& [value, what] : errors_of(step))
      if (const std::string too_low = below(value, optimum, bounds); !too_low.empty())
        return "has " + in_quotes(what) + " " + shortest(value.mse) + at(step) + too_low;
    before = &step;
  }
  const Scores& scores = closing.scores;
  for (const auto& [rule, what] : {std::pair(Rule::own, "uncured_mse"), {Rule::best, "best_uncured_mse"}})
    if (const double mse = scores.uncured_mse[rule]; mse < bounds.lowest || mse > bounds.highest)
      return "has " + in_quotes(what) + " " + shortest(mse) + "; " + bounds.what;
  if (const std::string flaw = flaw_of_criteria(closing); !flaw.empty()) return flaw;
  for (const auto& [rule, what] : {std::pair(Rule::current, "glued_mse"), {Rule::best, "best_mse"}})
    if (const std::string flaw = flaw_of_errors(scores.by_step[rule], what, optimum, bounds); !flaw.empty())
      return flaw;
  if (!std::isnan(scores.uncured_mse[Rule::own]) && scores.by_step[Rule::current].mse.empty() && !steps.empty())
    return "has 'uncured_mse', but lacks 'glued_mse'";
  if (terms.known && !terms.has_truth && !std::isnan(optimum))
    return "has 'own_optimum_mse', but its scene has no ground truth";
  if (!std::isnan(optimum) && !bounds.contain(optimum)) return "has 'own_optimum_mse' " + shortest(optimum);
  if (const std::vector<double>& pose = closing.own_optimum.pose; !pose.empty() && !steps.empty()) {
    if (const std::string flaw = flaw_of_pose(pose, terms.axes, true, false); !flaw.empty())
      return "has 'own_optimum_pose' " + flaw;
  }
  std::string flaw;
  trial_columns(
      [&flaw](const Column& column, const auto& value) {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>)
          if (column.is(kShare) && (value < 0 || value > 1))
            flaw =
                "has " + in_quotes(std::string(column.key)) + " " + shortest(value) + ", which is a share from 0 to 1";
      },
      closing);
  return flaw;
}

}  // namespace relign::records
