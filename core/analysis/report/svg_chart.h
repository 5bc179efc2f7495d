// Charts: lines, step functions and marks with bands or intervals, on linear, logarithmic or categorical axes.
// A page has their specifications, which chart.js draws; files are drawn here, on white, and equal charts give equal
// bytes.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/json_source.h"
#include "markup/html_writer.h"

namespace relign::report {

struct ChartPoint {
  double x = 0, y = 0;                                    // NaN: no point
  double low = std::numeric_limits<double>::quiet_NaN();  // interval around y; NaN: none
  double high = std::numeric_limits<double>::quiet_NaN();
};

enum class Drawn { line, steps, marks, marked_line };

struct ChartSeries {
  std::string name;
  int style = 0;  // colour and dash, the same for one method in every chart; kOracleStyle
  Drawn drawn = Drawn::line;
  std::vector<ChartPoint> points;  // x rising
};

struct ChartLevel {  // a horizontal line
  std::string label;
  double y = 0;
  bool dotted = false;  // else dashed
};

struct ChartAxis {
  std::string title;
  bool logarithmic = false;                               // linear if no value is positive
  bool whole = false;                                     // tick marks at integers only
  std::vector<std::string> categories;                    // of x only, whose values are indices into this list
  double low = std::numeric_limits<double>::quiet_NaN();  // NaN: from the data
  double high = std::numeric_limits<double>::quiet_NaN();
};

struct Chart {
  std::string title;
  ChartAxis x, y;
  std::vector<ChartSeries> series;  // most important first: without room the last ones have no label
  std::vector<ChartLevel> levels;
  double width = 460, height = 280;
};

inline constexpr int kOracleStyle = -1;

// The colours of styles 0, 1, ... on white; they repeat with the next dash pattern.
const std::vector<std::string>& series_colours();
std::string series_dash(int style);  // an SVG dash array; "" for a plain line

// The specification, as chart.js reads it.
Json chart_json(const Chart& chart);

// A standalone file.
std::string chart_svg(const Chart& chart);

// The numbers as CSV (RFC 4180): series, x, y, low, high; one row per point and level.
std::string chart_csv(const Chart& chart);

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
