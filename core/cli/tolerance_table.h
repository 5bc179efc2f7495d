// Predicts from derivatives how well lenses of a noise level can be aligned, and which offsets of elements limit it.
#pragma once

#include <string>
#include <vector>

#include "cli/app.h"
#include "cli/workbench.h"

namespace relign::cli {

struct ToleranceTable {
  // RMSE that one standard deviation of an offset causes at the nominal pose, and what alignment leaves of it; its
  // share of the mean MSE that alignment leaves.
  struct Offset {
    std::string element, name, unit;
    double deviation = 0, at_nominal = 0, aligned = 0, share = 0;
  };
  // RMSE at the best pose: predicted, and found by search; below `found_error` a search finds noise.
  struct Lens {
    double predicted = 0, found = 0, found_error = 0;
  };
  std::vector<Offset> offsets;    // the largest share first; those that are drawn
  std::vector<double> predicted;  // RMSE of each drawn lens at its best pose, sorted; infinite outside the travel
  std::size_t outside = 0;        // lenses whose best pose is outside the travel
  double error = 0;               // standard error of the mean square that alignment leaves, as a share of it
  std::vector<Lens> checked;
};

// Throws Error(bad_input) if the scene offers no derivatives, if their noise hides what alignment leaves, or with
// `checked` above 0 if the scene does not search for best poses.
ToleranceTable tolerance_table(const LoadedScene& scene, const plugin_host::Choice& level,
                               const plugin_host::HostServices& services, unsigned draws, unsigned checked,
                               std::uint32_t samples);

// spec: an RMSE; 0: none.
std::string tolerances_text(const ToleranceTable& table, double spec);
Json tolerances_json(const ToleranceTable& table, double spec);

}  // namespace relign::cli
