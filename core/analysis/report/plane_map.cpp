#include "report/plane_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/text.h"
#include "report/chart_scale.h"

namespace relign::report {
namespace {

constexpr std::array<const char*, 10> kColours = {"#440154", "#482878", "#3e4989", "#31688e", "#26828e",
                                                  "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"};
constexpr std::size_t kCells = 4;  // interpolated between neighbouring values, per axis
constexpr double kMapLeft = 64, kTop = 10, kSide = 220, kBar = 14, kWidth = 380, kHeight = 280;
constexpr double kBarLeft = kMapLeft + kSide + 22;

struct Grid {
  std::size_t columns, rows;
  std::vector<double> values;
  double at(std::size_t column, std::size_t row) const { return values[row * columns + column]; }
};

// Bilinear interpolation at cell centres.
Grid finer(const Grid& coarse) {
  Grid fine = {(coarse.columns - 1) * kCells, (coarse.rows - 1) * kCells, {}};
  for (std::size_t y = 0; y < fine.rows; ++y)
    for (std::size_t x = 0; x < fine.columns; ++x) {
      const std::size_t column = x / kCells, row = y / kCells;
      const double s = (static_cast<double>(x % kCells) + 0.5) / kCells,
                   t = (static_cast<double>(y % kCells) + 0.5) / kCells;
      fine.values.push_back((1 - t) * ((1 - s) * coarse.at(column, row) + s * coarse.at(column + 1, row)) +
                            t * ((1 - s) * coarse.at(column, row + 1) + s * coarse.at(column + 1, row + 1)));
    }
  return fine;
}

std::size_t level_of(double value, double low, double high) {
  if (!(high > low)) return 0;
  const double share = (value - low) / (high - low);
  return std::min(kColours.size() - 1, static_cast<std::size_t>(share * static_cast<double>(kColours.size())));
}

// One path per colour, of runs of equal cells; y points upwards.
std::array<std::string, kColours.size()> paths_of(const Grid& grid, double low, double high) {
  std::array<std::string, kColours.size()> paths;
  for (std::size_t row = 0; row < grid.rows; ++row)
    for (std::size_t column = 0; column < grid.columns;) {
      const std::size_t level = level_of(grid.at(column, row), low, high);
      std::size_t end = column + 1;
      while (end < grid.columns && level_of(grid.at(end, row), low, high) == level) ++end;
      const std::string length = std::to_string(end - column);
      paths[level] += "M" + std::to_string(column) + " " + std::to_string(grid.rows - 1 - row) + "h" + length + "v1h-" +
                      length + "z";
      column = end;
    }
  return paths;
}

void text(HtmlWriter& html, double x, double y, const char* anchor, const std::string& what) {
  html.element("text", {{"x", pixels_text(x)}, {"y", pixels_text(y)}, {"text-anchor", anchor}}, what);
}

void line(HtmlWriter& html, double x1, double y1, double x2, double y2) {
  html.empty("line", {{"x1", pixels_text(x1)},
                      {"y1", pixels_text(y1)},
                      {"x2", pixels_text(x2)},
                      {"y2", pixels_text(y2)},
                      {"stroke", "currentColor"},
                      {"stroke-opacity", "0.6"}});
}

std::string title_of(const LandscapePlane::Axis& axis) {
  return axis.name + (axis.unit.empty() ? "" : " / " + axis.unit);
}

void axes(HtmlWriter& html, const LandscapePlane& plane) {
  const ChartScale across(plane.across.values.front(), plane.across.values.back(), false, kMapLeft, kMapLeft + kSide);
  for (const auto& [value, mark] : across.marks(4, false)) {
    line(html, across(value), kTop + kSide, across(value), kTop + kSide + 4);
    text(html, across(value), kTop + kSide + 16, "middle", mark);
  }
  text(html, kMapLeft + kSide / 2, kTop + kSide + 34, "middle", title_of(plane.across));
  const ChartScale up(plane.up.values.front(), plane.up.values.back(), false, kTop + kSide, kTop);
  for (const auto& [value, mark] : up.marks(4, false)) {
    line(html, kMapLeft - 4, up(value), kMapLeft, up(value));
    text(html, kMapLeft - 7, up(value) + 4, "end", mark);
  }
  const std::string middle = pixels_text(kTop + kSide / 2);
  html.element("text",
               {{"x", "14"}, {"y", middle}, {"text-anchor", "middle"}, {"transform", "rotate(-90 14 " + middle + ")"}},
               title_of(plane.up));
}

void legend(HtmlWriter& html, double low, double high) {
  const double step = kSide / kColours.size();
  for (std::size_t level = 0; level < kColours.size(); ++level)
    html.empty("rect", {{"x", pixels_text(kBarLeft)},
                        {"y", pixels_text(kTop + kSide - static_cast<double>(level + 1) * step)},
                        {"width", pixels_text(kBar)},
                        {"height", pixels_text(step)},
                        {"fill", kColours[level]}});
  text(html, kBarLeft + kBar + 5, kTop + kSide, "start", significant(low, 2));
  text(html, kBarLeft + kBar + 5, kTop + 9, "start", significant(high, 2));
  text(html, kBarLeft, kTop + kSide + 16, "start", "RMSE");
}

}  // namespace

void plane_map(HtmlWriter& html, const LandscapePlane& plane) {
  const Grid grid = {plane.across.values.size(), plane.up.values.size(), plane.rmse};
  const auto [low, high] = std::minmax_element(grid.values.begin(), grid.values.end());
  const Grid fine = finer(grid);
  html.open("svg", {{"class", "figure map"},
                    {"viewBox", "0 0 " + pixels_text(kWidth) + " " + pixels_text(kHeight)},
                    {"role", "img"},
                    {"aria-label", "error over " + plane.across.name + " and " + plane.up.name}});
  html.open("svg", {{"x", pixels_text(kMapLeft)},
                    {"y", pixels_text(kTop)},
                    {"width", pixels_text(kSide)},
                    {"height", pixels_text(kSide)},
                    {"viewBox", "0 0 " + std::to_string(fine.columns) + " " + std::to_string(fine.rows)},
                    {"preserveAspectRatio", "none"},
                    {"shape-rendering", "crispEdges"}});
  const auto paths = paths_of(fine, *low, *high);
  for (std::size_t level = 0; level < paths.size(); ++level)
    if (!paths[level].empty()) html.empty("path", {{"fill", kColours[level]}, {"d", paths[level]}});
  html.close();
  html.open("g", {{"class", "axis"}, {"font-size", "11"}, {"fill", "currentColor"}});
  axes(html, plane);
  legend(html, *low, *high);
  html.close().close();
}

}  // namespace relign::report
