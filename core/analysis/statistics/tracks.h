// The numbers that are followed over a trial, all RMSE.
#pragma once

#include <array>
#include <vector>

#include "records/step_numbers.h"

namespace relign::statistics {

// Of the capture; the lowest so far; noise-free at the commanded and at the recommended pose; by how much the
// recommended pose is worse than the best that the instance allows; noise-free, where gluing would leave the lens, at
// the pose of the lowest measured RMSE so far and at the commanded pose (the rules "best" and "current", rules.h).
// Beside them the clock: simulated seconds.
enum class Track {
  measured,
  best,
  commanded,
  recommended,
  excess,
  recommended_best,
  recommended_current,
  machine_seconds
};
inline constexpr std::array<Track, 7> kTracks = {Track::measured,           Track::best,   Track::commanded,
                                                 Track::recommended,        Track::excess, Track::recommended_best,
                                                 Track::recommended_current};
inline constexpr std::size_t kTracksBeforeTheClock = 5;  // of kTracks, in tables: their columns keep their places
const char* track_name(Track track);

// The step of the lowest measured RMSE, the first of equal ones; of steps without any the first.
std::size_t best_step(const std::vector<records::StepNumbers>& steps);

// Noise-free MSE of the pose that one of the three tracks named recommended follows, one a step; NaN where a step has
// none. Unbiased, so it may be slightly negative.
std::vector<double> recommended_mse(const std::vector<records::StepNumbers>& steps, Track track);

// All values of a track, one a step; NaN where a step has none. Noise-free RMSE and excess are sqrt(max(0, MSE)): the
// unbiased MSE may be slightly negative. `own_optimum_mse`: of the instance; NaN when it is not known, then there is no
// excess.
std::vector<double> track_values(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Track track);

}  // namespace relign::statistics
