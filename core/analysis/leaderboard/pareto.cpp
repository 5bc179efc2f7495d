#include "leaderboard/pareto.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/page_numbers.h"

namespace relign::leaderboard {
namespace {

using report::number_text;

bool drawn(const CostPoint& point) { return std::isfinite(point.cost) && std::isfinite(point.error.estimate); }

}  // namespace

std::vector<std::size_t> pareto_front(const std::vector<CostPoint>& points) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (drawn(points[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return points[a].cost != points[b].cost ? points[a].cost < points[b].cost
                                            : points[a].error.estimate < points[b].error.estimate;
  });
  std::vector<std::size_t> front;
  double lowest = INFINITY;
  for (const std::size_t i : order) {
    if (points[i].error.estimate >= lowest) continue;
    lowest = points[i].error.estimate;
    front.push_back(i);
  }
  return front;
}

std::optional<report::Figure> cost_figure(const CostPicture& picture) {
  const std::vector<CostPoint>& points = picture.points;
  if (std::count_if(points.begin(), points.end(), drawn) < 2) return std::nullopt;
  const std::vector<std::size_t> front = pareto_front(points);
  report::Chart chart;
  chart.title = picture.title;
  const bool has_zero = std::any_of(points.begin(), points.end(), [](const CostPoint& p) { return p.cost <= 0; });
  chart.x = {
      picture.axis + (picture.unit.empty() ? "" : ", " + picture.unit), picture.logarithmic && !has_zero, false, {}};
  if (has_zero || !picture.logarithmic) chart.x.low = 0;
  chart.y = {"normalised error", false, false, {}, 0, 1};
  chart.height = 300;
  std::vector<std::string> words;
  report::ChartSeries line = {"Pareto front", report::kOracleStyle, report::Drawn::steps, {}};
  for (const std::size_t i : front) {
    const CostPoint& point = points[i];
    line.points.push_back({point.cost, point.error.estimate});
    words.push_back(point.name + " (" + number_text(point.cost, 3) + (picture.unit.empty() ? "" : " " + picture.unit) +
                    ", error " + number_text(point.error.estimate, 3) + ")");
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    if (drawn(points[i]))
      chart.series.push_back(
          {points[i].name,
           static_cast<int>(i),
           report::Drawn::marks,
           {{points[i].cost, points[i].error.estimate, points[i].error.interval.low, points[i].error.interval.high}}});
  chart.series.push_back(std::move(line));
  return report::Figure{report::figure_file_name(picture.title),
                        picture.title +
                            ". On the Pareto front, where no other method has both a lower cost and a lower error: " +
                            join(words, "; ") + ".",
                        std::move(chart)};
}

}  // namespace relign::leaderboard
