#include "statistics/tracks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relign::statistics {

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
    case Track::recommended_best:
      return "recommended_best";
    case Track::recommended_current:
      return "recommended_current";
    case Track::machine_seconds:
      return "machine_seconds";
  }
  return "";
}

std::size_t best_step(const std::vector<records::StepNumbers>& steps) {
  std::size_t best = 0;
  for (std::size_t step = 1; step < steps.size(); ++step)
    if (steps[step].measured < steps[best].measured || std::isnan(steps[best].measured)) best = step;
  return best;
}

std::vector<double> recommended_mse(const std::vector<records::StepNumbers>& steps, Track track) {
  std::vector<double> values;
  values.reserve(steps.size());
  double best = std::numeric_limits<double>::quiet_NaN(), glued = best;
  for (const records::StepNumbers& step : steps) {
    if (values.empty() || step.measured < best || std::isnan(best)) best = step.measured, glued = step.glued_mse;
    values.push_back(track == Track::recommended_best      ? std::isnan(step.best_mse) ? glued : step.best_mse
                     : track == Track::recommended_current ? step.glued_mse
                                                           : step.recommended_mse);
  }
  return values;
}

std::vector<double> track_values(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Track track,
                                 const SceneScore& score) {
  if (track == Track::recommended || track == Track::recommended_best || track == Track::recommended_current) {
    std::vector<double> values = recommended_mse(steps, track);
    for (double& value : values) value = score.shown(value);
    return values;
  }
  std::vector<double> values;
  values.reserve(steps.size());
  double best = std::numeric_limits<double>::quiet_NaN();
  for (const records::StepNumbers& step : steps) {
    switch (track) {
      case Track::measured:
        values.push_back(step.measured);
        break;
      case Track::best:
        best = std::fmin(best, step.measured);  // fmin ignores NaN
        values.push_back(best);
        break;
      case Track::commanded:
        values.push_back(score.shown(step.commanded_mse));
        break;
      case Track::excess:
        values.push_back(score.shown(step.recommended_mse - own_optimum_mse));
        break;
      case Track::machine_seconds:
        values.push_back(step.machine_seconds);
        break;
      case Track::recommended:
      case Track::recommended_best:
      case Track::recommended_current:
        break;  // above
    }
  }
  return values;
}

}  // namespace relign::statistics
