#include "stats/curves.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace relign::stats {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double displayed(double mse) { return std::isnan(mse) ? mse : std::sqrt(std::max(0.0, mse)); }

// NumPy's default: linear interpolation at (n - 1) p of the sorted values.
double quantile(const std::vector<double>& sorted, double share) {
  const double place = static_cast<double>(sorted.size() - 1) * share;
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double fraction = place - static_cast<double>(below);
  if (fraction == 0) return sorted[below];  // keeps infinities from meeting
  return sorted[below] + fraction * (sorted[above] - sorted[below]);
}

// All values of a track, step 0 to the last step of the trial; empty when there is none.
std::vector<double> track_values(const records::TrialRecord& trial, Track track) {
  std::vector<double> values;
  if (track == Track::excess && !trial.has_own_optimum) return values;
  values.reserve(trial.steps.size());
  double best = kNone;
  for (const records::StepRecord& step : trial.steps) {
    switch (track) {
      case Track::measured:
        values.push_back(step.measured);
        break;
      case Track::best:
        best = std::fmin(best, step.measured);  // fmin passes over a NaN
        values.push_back(best);
        break;
      case Track::commanded:
        values.push_back(displayed(step.commanded_mse));
        break;
      case Track::recommended:
        values.push_back(displayed(step.recommended_mse));
        break;
      case Track::excess:
        values.push_back(displayed(step.recommended_mse - trial.own_optimum_mse));
        break;
    }
  }
  return values;
}

void fill(Curve& curve, const std::vector<const records::TrialRecord*>& trials) {
  unsigned largest = 0;
  for (const records::TrialRecord* trial : trials) largest = std::max(largest, trial->budget);
  if (trials.empty()) return;
  curve.points.resize(largest + std::size_t{1});
  for (std::size_t step = 0; step < curve.points.size(); ++step) curve.points[step].step = static_cast<unsigned>(step);
  for (std::size_t track = 0; track < kTracks.size(); ++track) {
    std::vector<std::vector<double>> values;
    for (const records::TrialRecord* trial : trials) values.push_back(track_values(*trial, kTracks[track]));
    for (CurvePoint& point : curve.points) {
      std::vector<double> here;
      for (const std::vector<double>& of_trial : values)
        if (!of_trial.empty()) here.push_back(of_trial[std::min<std::size_t>(point.step, of_trial.size() - 1)]);
      point.tracks[track] = quantiles(std::move(here));
    }
  }
}

}  // namespace

Quantiles quantiles(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double value) { return std::isnan(value); }),
               values.end());
  Quantiles result{values.size(), kNone, kNone, kNone, kNone};
  if (values.empty()) return result;
  // Summed in sorted order: the mean does not depend on the order of the trials.
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (const double value : values) sum += value;
  result.mean = sum / static_cast<double>(values.size());
  result.median = quantile(values, 0.5);
  result.q25 = quantile(values, 0.25);
  result.q75 = quantile(values, 0.75);
  return result;
}

const char* track_name(Track track) {
  switch (track) {
    case Track::measured:
      return "measured";
    case Track::best:
      return "best";
    case Track::commanded:
      return "commanded";
    case Track::recommended:
      return "recommended";
    case Track::excess:
      return "excess";
  }
  return "";
}

std::optional<double> track_value(const records::TrialRecord& trial, Track track, unsigned step) {
  const std::vector<double> values = track_values(trial, track);
  if (values.empty()) return std::nullopt;
  const double value = values[std::min<std::size_t>(step, values.size() - 1)];
  return std::isnan(value) ? std::nullopt : std::optional<double>(value);
}

std::vector<Curve> make_curves(const std::vector<records::TrialRecord>& trials) {
  std::vector<Curve> curves;
  std::vector<std::vector<const records::TrialRecord*>> members;
  std::map<std::tuple<std::string, std::string, std::string, std::string>, std::size_t> place;
  for (const records::TrialRecord& trial : trials) {
    const auto [found, fresh] =
        place.emplace(std::make_tuple(trial.scene, trial.noise_level, trial.protocol, trial.algorithm), curves.size());
    if (fresh) {
      Curve curve;
      curve.scene = trial.scene;
      curve.noise_level = trial.noise_level;
      curve.protocol = trial.protocol;
      curve.algorithm = trial.algorithm;
      curves.push_back(curve);
      members.emplace_back();
    }
    if (!records::ended_well(trial.end) || trial.steps.empty())
      ++curves[found->second].failed;
    else
      members[found->second].push_back(&trial);
  }
  for (std::size_t index = 0; index < curves.size(); ++index) {
    curves[index].trials = members[index].size();
    fill(curves[index], members[index]);
  }
  return curves;
}

}  // namespace relign::stats
