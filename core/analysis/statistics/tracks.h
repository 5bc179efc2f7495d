// Tracks: the quantities recorded per step of a trial, all of them values of the score of its scene.
#pragma once

#include <array>
#include <vector>

#include "base/scene_score.h"
#include "records/step_numbers.h"

namespace relign::statistics {

enum class Track {
  measured,             // of the capture, camera noise included
  best,                 // lowest measured so far
  commanded,            // noise-free, at the commanded pose
  recommended,          // noise-free after curing, at the recommended pose
  excess,               // recommended above the instance's own optimum, for the RMSE: sqrt(difference of MSE)
  recommended_best,     // noise-free after curing, at the pose with the lowest measured score so far (rule "best")
  recommended_current,  // noise-free after curing, at the commanded pose (rule "current")
  machine_seconds       // simulated time, not a score
};
inline constexpr std::array<Track, 7> kTracks = {Track::measured,           Track::best,   Track::commanded,
                                                 Track::recommended,        Track::excess, Track::recommended_best,
                                                 Track::recommended_current};
inline constexpr std::size_t kTracksBeforeTheClock =
    5;  // in tables machine_seconds follows these, so that old columns keep their places
const char* track_name(Track track);

// The step with the lowest measured score; the first of equal ones, and the first step if none was measured.
std::size_t best_step(const std::vector<records::StepNumbers>& steps);

// Noise-free MSE behind one of the three recommended tracks, one per step; NaN if missing. Unbiased, so it may be
// slightly negative.
std::vector<double> recommended_mse(const std::vector<records::StepNumbers>& steps, Track track);

// One value per step; NaN if missing. Noise-free scores and their excess are shown, max(0, value) and for the RMSE
// sqrt(max(0, MSE)), since unbiased estimates may be slightly negative. `own_optimum_mse` is the instance's; if NaN,
// excess is NaN.
std::vector<double> track_values(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Track track,
                                 const SceneScore& score);

}  // namespace relign::statistics
