// Distances of the instances' own optima from the nominal pose, by noise level: the size of the alignment task.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/app.h"

namespace relign::cli {

struct LevelOptima {
  std::string score, level;
  std::size_t instances = 0;
  struct Spread {
    double median = 0, largest = 0;
  };
  Spread shift_mm, tilt_deg;  // between own optimum and nominal pose
  Spread own_rmse;            // noise-free, at the own optimum
  Spread nominal_rmse;        // noise-free, at the nominal pose
};

// Over instances 0 to `instances` - 1 of suite seed 1. Throws Error(bad_input) if the scene does not search for own
// optima.
std::vector<LevelOptima> level_optima(Context& context, const std::string& scene,
                                      const std::vector<std::string>& levels, unsigned instances);

std::string optima_text(const std::vector<LevelOptima>& levels);
Json optima_json(const std::vector<LevelOptima>& levels);

}  // namespace relign::cli
