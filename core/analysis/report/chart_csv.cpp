// The colours of charts, and charts as CSV.
#include <cmath>

#include "base/text.h"
#include "markup/escape.h"
#include "report/page_numbers.h"
#include "report/svg_chart.h"

namespace relign::report {
namespace {

constexpr int kTableDigits = 7;  // hides rounding errors as of 100 * 0.57

bool is_finite(double value) { return std::isfinite(value); }

std::string number_field(double value) { return is_finite(value) ? shortest(rounded(value, kTableDigits)) : ""; }

}  // namespace

const std::vector<std::string>& series_colours() {
  static const std::vector<std::string> kColours = {"#0072B2", "#D55E00", "#009E73", "#B5598E",
                                                    "#B97F00", "#2E94CC", "#3A3F47"};
  return kColours;
}

std::string series_dash(int style) {
  static const std::vector<std::string> kDashes = {"", "8 4", "2 3", "10 3 2 3", "14 4", "5 2 1 2 1 2"};
  if (style < 0) return "4 4";
  return kDashes[static_cast<std::size_t>(style) / series_colours().size() % kDashes.size()];
}

std::string chart_csv(const Chart& chart) {
  std::string csv = "series," + csv_field(chart.x.title) + "," + csv_field(chart.y.title) + ",low,high\n";
  for (const ChartSeries& series : chart.series)
    for (const ChartPoint& point : series.points) {
      if (!is_finite(point.x) || !is_finite(point.y)) continue;
      const bool named = point.x >= 0 && point.x < static_cast<double>(chart.x.categories.size());
      csv += csv_field(series.name) + "," +
             (named ? csv_field(chart.x.categories[static_cast<std::size_t>(point.x)]) : number_field(point.x)) + "," +
             number_field(point.y) + "," + number_field(point.low) + "," + number_field(point.high) + "\n";
    }
  for (const ChartLevel& level : chart.levels)
    if (is_finite(level.y)) csv += csv_field(level.label) + ",," + number_field(level.y) + ",,\n";
  return csv;
}

}  // namespace relign::report
