// Error against a cost: which methods no other beats in both, and the chart.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/figures.h"
#include "statistics/band.h"

namespace relign::leaderboard {

struct CostPoint {
  std::string name;
  double cost = statistics::kMissing;  // NaN: unknown, not drawn
  statistics::Band error;
};

// Indices of the points on the Pareto front, by rising cost: no other point has a lower or equal cost and a lower or
// equal error, one of them lower. Of equal points only the first. Points without cost or error are left out.
std::vector<std::size_t> pareto_front(const std::vector<CostPoint>& points);

struct CostPicture {
  std::string title;        // "Error against machine time"
  std::string axis, unit;   // "machine time per alignment", "s"
  bool logarithmic = true;  // linear if some cost is 0
  std::vector<CostPoint> points;
};

// Points, intervals and the front as a line; the caption names the front, so that nothing is in the chart alone.
// Nothing with fewer than two points.
std::optional<report::Figure> cost_figure(const CostPicture& picture);

}  // namespace relign::leaderboard
