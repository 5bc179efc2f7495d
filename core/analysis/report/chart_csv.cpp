// The colours of charts, and charts as CSV and JSON.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "markup/escape.h"
#include "report/json_put.h"
#include "report/page_numbers.h"
#include "report/svg_chart.h"

namespace relign::report {
namespace {

constexpr double kTallest = 400;  // on the page, where labels may be omitted; figures for papers have all
constexpr int kTableDigits = 7;   // hides rounding errors as of 100 * 0.57

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

Json chart_json(const Chart& chart) {
  static constexpr const char* kDrawn[] = {"line", "steps", "marks", "marked_line"};
  constexpr int kPageDigits = 4;
  const auto axis_json = [](const ChartAxis& axis) {
    Json json = {{"title", axis.title}, {"log", axis.logarithmic}, {"whole", axis.whole}};
    if (!axis.categories.empty()) json["categories"] = axis.categories;
    if (is_finite(axis.low)) json["low"] = axis.low;
    if (is_finite(axis.high)) json["high"] = axis.high;
    return json;
  };
  Json series = Json::array(), levels = Json::array();
  for (const ChartSeries& one : chart.series) {
    Json& made = series.emplace_back(
        Json{{"name", one.name}, {"style", one.style}, {"drawn", kDrawn[static_cast<std::size_t>(one.drawn)]}});
    const auto put_all = [&](const char* name, double ChartPoint::*value) {
      made[name] = Json::array();
      for (const ChartPoint& point : one.points) made[name].push_back(number(rounded(point.*value, kPageDigits)));
    };
    put_all("x", &ChartPoint::x);
    put_all("y", &ChartPoint::y);
    if (std::none_of(one.points.begin(), one.points.end(), [](const ChartPoint& p) { return is_finite(p.low); }))
      continue;
    put_all("low", &ChartPoint::low);
    put_all("high", &ChartPoint::high);
  }
  for (const ChartLevel& level : chart.levels)
    if (is_finite(level.y)) levels.push_back({{"label", level.label}, {"y", level.y}, {"dotted", level.dotted}});
  return {{"title", chart.title}, {"x", axis_json(chart.x)}, {"y", axis_json(chart.y)},
          {"series", series},     {"levels", levels},        {"height", std::min(chart.height, kTallest)}};
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
