// The five numbers that are followed over a trial, all RMSE.
#pragma once

#include <array>
#include <vector>

#include "records/step_numbers.h"

namespace relign::stats {

// Of the capture; the lowest so far; noise-free at the commanded and at the recommended pose; by how much the
// recommended pose is worse than the best that the instance allows.
// Beside them the clock: simulated seconds.
enum class Track { measured, best, commanded, recommended, excess, machine_seconds };
inline constexpr std::array<Track, 5> kTracks = {Track::measured, Track::best, Track::commanded, Track::recommended,
                                                 Track::excess};
const char* track_name(Track track);

// All values of a track, one a step; NaN where a step has none. Noise-free RMSE and excess are sqrt(max(0, MSE)): the
// unbiased MSE may be slightly negative. `own_optimum_mse`: of the instance; NaN when it is not known, then there is no
// excess.
std::vector<double> track_values(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Track track);

}  // namespace relign::stats
