// The scale of a chart axis: values to pixels, and tick marks.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace relign::report {

class ChartScale {
 public:
  // `low` < `high`, both positive if logarithmic; `from` and `to` are their positions in pixels.
  ChartScale(double low, double high, bool logarithmic, double from, double to);

  double operator()(double value) const;  // clipped to the axis; NaN stays NaN

  // Tick marks, about `count` round numbers within the axis, with their texts; integers only if `whole`.
  std::vector<std::pair<double, std::string>> marks(int count, bool whole) const;

 private:
  double low_, high_, from_, to_;
  bool logarithmic_;
};

// Rounded to tenths of a pixel, shortest text.
std::string pixels_text(double value);

// Positions of labels near `wanted` (most important first), at least `height` apart and between top and bottom. NaN for
// labels without room.
std::vector<double> spread_labels(const std::vector<double>& wanted, double top, double bottom, double height);

}  // namespace relign::report
