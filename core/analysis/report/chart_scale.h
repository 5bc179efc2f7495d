// From values to places on a chart's axis, and the marks along it.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace relign::report {

class ChartScale {
 public:
  // `low` < `high`, both positive where logarithmic; `from` and `to` are their places in pixels.
  ChartScale(double low, double high, bool logarithmic, double from, double to);

  double operator()(double value) const;  // clipped to the axis; NaN stays NaN

  // Values and their texts, about `count` of them: round numbers within the axis.
  std::vector<std::pair<double, std::string>> marks(int count, bool whole) const;

 private:
  double low_, high_, from_, to_;
  bool logarithmic_;
};

// Rounded to tenths of a pixel, shortest text.
std::string pixels_text(double value);

// Places for labels of `height` that would like to stand at `wanted` (in order of importance): none closer than
// `height`, all within top and bottom. As many as have room; NaN for the others.
std::vector<double> spread_labels(const std::vector<double>& wanted, double top, double bottom, double height);

}  // namespace relign::report
