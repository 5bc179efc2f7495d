// Charts as SVG, written here and nowhere else: lines, step functions and marks with bands or intervals, on linear,
// logarithmic or categorical axes. Equal charts give equal bytes. In a page they take its colours (page.css, so that
// they follow a dark scheme and paper); alone they carry their own on white, for a paper.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "markup/html_writer.h"

namespace relign::report {

struct ChartPoint {
  double x = 0, y = 0;                                    // NaN: no point here
  double low = std::numeric_limits<double>::quiet_NaN();  // the interval around y; NaN where there is none
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
  bool logarithmic = false;                               // falls back to linear where nothing is positive
  bool whole = false;                                     // only whole numbers are marked
  std::vector<std::string> categories;                    // of x alone: its values are places in this list
  double low = std::numeric_limits<double>::quiet_NaN();  // NaN: as the data want it
  double high = std::numeric_limits<double>::quiet_NaN();
};

struct Chart {
  std::string title;
  ChartAxis x, y;
  std::vector<ChartSeries> series;  // the most important first: where labels have no room, the last ones have none
  std::vector<ChartLevel> levels;
  double width = 460, height = 280;
};

enum class ChartUse { in_page, alone };

inline constexpr int kOracleStyle = -1;

// The colours of styles 0, 1, ... on white; when they are used up, the next dash begins.
const std::vector<std::string>& series_colours();
std::string series_dash(int style);  // an SVG dash array; "" for a plain line

void draw_chart(HtmlWriter& html, const Chart& chart, ChartUse use);

// A file of its own.
std::string chart_svg(const Chart& chart);

// The same numbers: series, x, y, low, high; a row for each point and level. RFC 4180.
std::string chart_csv(const Chart& chart);

}  // namespace relign::report
