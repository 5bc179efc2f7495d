#include "leaderboard/pareto.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "markup/escape.h"
#include "report/chart_scale.h"
#include "report/page_numbers.h"

namespace relign::leaderboard {
namespace {

using report::ChartScale;
using report::number_text;
using report::pixels_text;

constexpr double kWidth = 460, kHeight = 300, kLeft = 50, kRight = 448, kTop = 10, kBottom = 256;
constexpr double kCharacter = 6.1;
constexpr std::size_t kMostLetters = 24;

bool drawn(const CostPoint& point) { return std::isfinite(point.cost) && std::isfinite(point.error.estimate); }

// Costs of the axis, with room at both ends.
struct Ends {
  double low = 0, high = 1;
  bool logarithmic = false;
};

Ends ends_of(const CostPicture& picture) {
  double low = INFINITY, high = -INFINITY;
  for (const CostPoint& point : picture.points) {
    if (!drawn(point)) continue;
    low = std::min(low, point.cost);
    high = std::max(high, point.cost);
  }
  if (picture.logarithmic && low > 0) {
    const double room = std::max(1.3, std::pow(high / low, 0.06));
    return {low / room, high * room, true};
  }
  return {0, high > 0 ? 1.06 * high : 1, false};
}

void axes(HtmlWriter& html, const CostPicture& picture, const ChartScale& x, const ChartScale& y) {
  html.open("g", {{"class", "axis"}});
  std::string grid, frame = "M" + pixels_text(kLeft) + " " + pixels_text(kTop) + "V" + pixels_text(kBottom) + "H" +
                            pixels_text(kRight);
  const auto text = [&](double at_x, double at_y, const std::string& words, const char* anchor,
                        const std::string& turned = "") {
    Attributes attributes = {
        {"x", pixels_text(at_x)}, {"y", pixels_text(at_y)}, {"fill", "currentColor"}, {"text-anchor", anchor}};
    if (!turned.empty()) attributes.emplace_back("transform", turned);
    html.element("text", attributes, words);
  };
  for (const auto& [value, words] : x.marks(7, false)) {
    frame += "M" + pixels_text(x(value)) + " " + pixels_text(kBottom) + "v4";
    text(x(value), kBottom + 16, words, "middle");
  }
  for (const auto& [value, words] : y.marks(6, false)) {
    grid += "M" + pixels_text(kLeft) + " " + pixels_text(y(value)) + "H" + pixels_text(kRight);
    text(kLeft - 6, y(value) + 4, words, "end");
  }
  html.empty("path", {{"d", grid}, {"stroke", "currentColor"}, {"stroke-opacity", "0.18"}});
  html.empty("path", {{"d", frame}, {"stroke", "currentColor"}, {"stroke-opacity", "0.6"}});
  text((kLeft + kRight) / 2, kBottom + 34, picture.axis + (picture.unit.empty() ? "" : ", " + picture.unit), "middle");
  const double middle = (kTop + kBottom) / 2;
  text(11, middle, "normalised error", "middle", "rotate(-90 11 " + pixels_text(middle) + ")");
  html.close();
}

// The staircase through the front.
std::string front_path(const std::vector<CostPoint>& points, const std::vector<std::size_t>& front, const ChartScale& x,
                       const ChartScale& y) {
  std::string d;
  for (const std::size_t i : front)
    d += (d.empty() ? "M" + pixels_text(x(points[i].cost)) + " " + pixels_text(y(points[i].error.estimate))
                    : "H" + pixels_text(x(points[i].cost)) + "V" + pixels_text(y(points[i].error.estimate)));
  return d + "H" + pixels_text(kRight);
}

void mark(HtmlWriter& html, const CostPoint& point, bool on_front, double x, const ChartScale& y) {
  html.open("g", {{"class", on_front ? "front" : "behind"}}).element("title", point.name);
  if (point.error.interval.exists())
    html.empty("path", {{"d", "M" + pixels_text(x) + " " + pixels_text(y(point.error.interval.low)) + "V" +
                                  pixels_text(y(point.error.interval.high))},
                        {"stroke", "currentColor"},
                        {"stroke-opacity", "0.6"}});
  html.empty("circle", {{"cx", pixels_text(x)},
                        {"cy", pixels_text(y(point.error.estimate))},
                        {"r", on_front ? "4" : "3"},
                        {"fill", on_front ? "currentColor" : "none"},
                        {"stroke", "currentColor"}});
  html.close();
}

// Names of the front, beside their points and apart from each other.
void front_labels(HtmlWriter& html, const std::vector<CostPoint>& points, const std::vector<std::size_t>& front,
                  const ChartScale& x, const ChartScale& y) {
  std::vector<double> wanted;
  for (const std::size_t i : front) wanted.push_back(y(points[i].error.estimate) - 7);
  const std::vector<double> places = report::spread_labels(wanted, kTop + 8, kBottom - 4, 12);
  html.open("g", {{"class", "front labels"}});
  for (std::size_t k = 0; k < front.size(); ++k) {
    if (!std::isfinite(places[k])) continue;
    const std::string words = clipped(points[front[k]].name, kMostLetters);
    const double at = x(points[front[k]].cost);
    const bool left = at + 8 + kCharacter * static_cast<double>(columns(words)) > kRight;
    html.element("text",
                 {{"x", pixels_text(left ? at - 7 : at + 7)},
                  {"y", pixels_text(places[k] + 3)},
                  {"fill", "currentColor"},
                  {"text-anchor", left ? "end" : "start"}},
                 words);
  }
  html.close();
}

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

void draw_costs(HtmlWriter& html, const CostPicture& picture) {
  const std::vector<CostPoint>& points = picture.points;
  if (std::count_if(points.begin(), points.end(), drawn) < 2) return;
  const std::vector<std::size_t> front = pareto_front(points);
  std::vector<std::string> words;
  for (const std::size_t i : front)
    words.push_back(points[i].name + " (" + number_text(points[i].cost, 3) +
                    (picture.unit.empty() ? "" : " " + picture.unit) + ", error " +
                    number_text(points[i].error.estimate, 3) + ")");
  const std::string caption =
      picture.title +
      ". On the Pareto front, where no other method has both a lower cost and a lower error: " + join(words, "; ") +
      ".";
  const Ends ends = ends_of(picture);
  const ChartScale x(ends.low, ends.high, ends.logarithmic, kLeft, kRight), y(0, 1, false, kBottom, kTop);
  html.open("figure", {{"class", "plot"}});
  html.open("svg", {{"class", "figure costs"},
                    {"viewBox", "0 0 " + pixels_text(kWidth) + " " + pixels_text(kHeight)},
                    {"role", "img"},
                    {"aria-label", caption},
                    {"font-size", "11"},
                    {"fill", "none"}});
  axes(html, picture, x, y);
  html.empty("path", {{"class", "staircase"}, {"d", front_path(points, front, x, y)}, {"stroke", "currentColor"}});
  for (std::size_t i = 0; i < points.size(); ++i)
    if (drawn(points[i]))
      mark(html, points[i], std::find(front.begin(), front.end(), i) != front.end(), x(points[i].cost), y);
  front_labels(html, points, front, x, y);
  html.close().element("figcaption", caption).close();
}

}  // namespace relign::leaderboard
