#include "drawing/landscape.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "drawing/colours.h"
#include "drawing/contours.h"
#include "drawing/raster_canvas.h"
#include "drawing/scales.h"
#include "drawing/svg_canvas.h"

namespace relign::drawing {
namespace {

constexpr double kPanel = 170, kGap = 28;
constexpr double kLeft = 78, kTop = 84, kRight = 30, kBottom = 66;
constexpr double kLegendWidth = 18;
constexpr int kTicks = 4;
constexpr int kContours = 10;
constexpr double kSlopes = 1000;  // of the longest arrow's to one of length 0
constexpr int kMapPixels = 170;   // a side of a panel's map

struct Range {
  double low = 0, high = 0;
  double share(double value) const { return high > low ? (value - low) / (high - low) : 0; }
};

Range range_of(const Landscape& landscape) {
  Range range{landscape.planes.front().values.front(), landscape.planes.front().values.front()};
  for (const LandscapePlane& plane : landscape.planes)
    for (const double value : plane.values) {
      range.low = std::min(range.low, value);
      range.high = std::max(range.high, value);
    }
  return range;
}

// The values, interpolated bilinearly, as colours; low values of the upward axis at the bottom.
Raster map_of(const LandscapePlane& plane, int points, const Range& range) {
  Raster map{kMapPixels, kMapPixels, {}};
  map.rgb.reserve(3UL * kMapPixels * kMapPixels);
  const auto place = [&](double pixel) {
    return std::clamp((pixel + 0.5) / kMapPixels * (points - 1), 0.0, points - 1.0);
  };
  const auto value = [&](int column, int row) { return plane.values[static_cast<std::size_t>(row * points + column)]; };
  for (int y = 0; y < kMapPixels; ++y)
    for (int x = 0; x < kMapPixels; ++x) {
      const double u = place(x), v = place(kMapPixels - 1 - y);
      const int column = std::min(static_cast<int>(u), points - 2), row = std::min(static_cast<int>(v), points - 2);
      const double s = u - column, t = v - row;
      const double between = (1 - t) * ((1 - s) * value(column, row) + s * value(column + 1, row)) +
                             t * ((1 - s) * value(column, row + 1) + s * value(column + 1, row + 1));
      const Colour colour = map_colour(range.share(between));
      map.rgb.insert(map.rgb.end(), {colour.red, colour.green, colour.blue});
    }
  return map;
}

Point in_panel(const Rectangle& panel, double share_across, double share_up) {
  return {panel.x + share_across * panel.width, panel.y + (1 - share_up) * panel.height};
}

// Visible on dark and bright background.
void draw_cross(Canvas& canvas, const Point& at) {
  constexpr double kArm = 4;  // fits inside the ring
  const std::vector<Segment> arms = {{{at.x - kArm, at.y}, {at.x + kArm, at.y}},
                                     {{at.x, at.y - kArm}, {at.x, at.y + kArm}}};
  canvas.segments(arms, {kInk, 3.5});
  canvas.segments(arms, {kWhite, 1.5});
}

void draw_ring(Canvas& canvas, const Point& at) {
  canvas.circle(at, 7, {}, Stroke{kInk, 3.5});
  canvas.circle(at, 7, {}, Stroke{kWhite, 1.5});
}

// Places between two arrows, at most 9 of them along an axis.
int arrow_step(int points) { return (points + 8) / 10; }

void draw_lines_of_arrows(Canvas& canvas, const std::vector<Segment>& lines) {
  canvas.segments(lines, {kInk, 2.8});
  canvas.segments(lines, {kWhite, 1.1});
}

// Centred on `middle`.
void add_arrow(std::vector<Segment>& lines, const Point& middle, const Point& along) {
  constexpr double kHead = 4.5;
  const double length = std::hypot(along.x, along.y), head = std::min(kHead, 0.5 * length) / length;
  const Point tip{middle.x + along.x / 2, middle.y + along.y / 2};
  lines.push_back({{middle.x - along.x / 2, middle.y - along.y / 2}, tip});
  for (const double side : {-0.6, 0.6})
    lines.push_back({tip, {tip.x - head * (along.x + side * along.y), tip.y - head * (along.y - side * along.x)}});
}

double steepest_of(const Landscape& landscape) {
  double steepest = 0;
  for (const LandscapePlane& plane : landscape.planes)
    for (const auto& [place, slope] : plane.slopes) steepest = std::max(steepest, std::hypot(slope.x, slope.y));
  return steepest;
}

// Each stays within a circle about its place that touches no neighbour's. Slopes beside a valley and within it differ
// by factors of a hundred, so that only logarithmic lengths show the directions of both.
void draw_arrows(Canvas& canvas, const Landscape& landscape, const LandscapePlane& plane, const Rectangle& panel) {
  constexpr double kShortest = 2;  // shorter ones would hide their direction
  const auto points = static_cast<std::size_t>(landscape.points);
  const double steps = landscape.points - 1, flattest = steepest_of(landscape) / kSlopes;
  const double longest = 0.85 * panel.width * arrow_step(landscape.points) / steps;
  std::vector<Segment> lines;
  for (const auto& [place, slope] : plane.slopes) {
    const double steep = std::hypot(slope.x, slope.y);
    const double length = steep > flattest ? longest * std::log(steep / flattest) / std::log(kSlopes) : 0;
    const Point middle =
        in_panel(panel, static_cast<double>(place % points) / steps, static_cast<double>(place / points) / steps);
    if (length >= kShortest) add_arrow(lines, middle, {-length / steep * slope.x, length / steep * slope.y});
  }
  draw_lines_of_arrows(canvas, lines);
}

std::string axis_title(const LandscapeAxis& axis) {
  return axis.unit.empty() ? axis.name : axis.name + " / " + axis.unit;
}

void draw_axis(Canvas& canvas, const Rectangle& panel, const LandscapeAxis& axis, bool upwards) {
  const std::vector<double> all = ticks(axis.lower, axis.upper, kTicks);
  const double step = all.size() > 1 ? all[1] - all[0] : 1;
  for (const double value : all) {
    const double share = axis.upper > axis.lower ? (value - axis.lower) / (axis.upper - axis.lower) : 0.5;
    const Point at = upwards ? in_panel(panel, 0, share) : in_panel(panel, share, 0);
    canvas.segments({{at, upwards ? Point{at.x - 4, at.y} : Point{at.x, at.y + 4}}}, {kQuietInk, 1});
    canvas.text(upwards ? Point{at.x - 7, at.y + 4} : Point{at.x, at.y + 16}, tick_text(value, step),
                {11, kQuietInk, upwards ? Anchor::end : Anchor::middle});
  }
  const double middle = upwards ? panel.y + panel.height / 2 : panel.x + panel.width / 2;
  canvas.text(upwards ? Point{panel.x - 44, middle} : Point{middle, panel.y + panel.height + 36}, axis_title(axis),
              {13, kInk, Anchor::middle, upwards, true});
}

void draw_panel(Canvas& canvas, const Landscape& landscape, const LandscapePlane& plane, const Rectangle& panel,
                const Range& range) {
  const LandscapeAxis &across = landscape.axes[plane.across], &up = landscape.axes[plane.up];
  canvas.open_group("panel", across.name + " and " + up.name);
  canvas.picture(panel, map_of(plane, landscape.points, range));
  const double steps = landscape.points - 1;
  for (int k = 1; k < kContours; ++k) {
    const double level = range.low + (range.high - range.low) * k / kContours;
    std::vector<Segment> lines = contour(plane.values, landscape.points, landscape.points, level);
    for (auto& [from, to] : lines) {
      from = in_panel(panel, from.x / steps, from.y / steps);
      to = in_panel(panel, to.x / steps, to.y / steps);
    }
    canvas.segments(lines, {{255, 255, 255, 0.55}, 0.6});
  }
  canvas.rectangle(panel, {}, Stroke{kInk, 1});
  draw_arrows(canvas, landscape, plane, panel);
  draw_cross(canvas, in_panel(panel, across.nominal, up.nominal));
  const std::size_t lowest = plane.lowest(), points = static_cast<std::size_t>(landscape.points);
  draw_ring(canvas, in_panel(panel, static_cast<double>(lowest % points) / steps,
                             static_cast<double>(lowest / points) / steps));
  if (plane.across == 0) draw_axis(canvas, panel, up, true);
  if (plane.up + 1 == landscape.axes.size()) draw_axis(canvas, panel, across, false);
  canvas.close_group();
}

void draw_legend(Canvas& canvas, const Landscape& landscape, const Rectangle& place, const Range& range) {
  constexpr int kSteps = 128;
  Raster bar{1, kSteps, {}};
  for (int k = 0; k < kSteps; ++k) {
    const Colour colour = map_colour(1 - (k + 0.5) / kSteps);
    bar.rgb.insert(bar.rgb.end(), {colour.red, colour.green, colour.blue});
  }
  canvas.picture(place, bar);
  canvas.rectangle(place, {}, Stroke{kInk, 1});
  const bool logarithmic = landscape.logarithmic_from > 0;
  const std::vector<double> all = ticks(range.low, range.high, 5);
  const double step = all.size() > 1 ? all[1] - all[0] : std::max(std::fabs(range.low), 1.0);
  for (const double value : all) {
    const double y = place.y + (1 - range.share(value)) * place.height;
    canvas.segments({{{place.x + place.width, y}, {place.x + place.width + 4, y}}}, {kQuietInk, 1});
    canvas.text({place.x + place.width + 8, y + 4},
                logarithmic ? significant(std::pow(10, value), 2) : tick_text(value, step), {11, kQuietInk});
  }
  canvas.text({place.x, place.y - 10}, landscape.measure, {13, kInk, Anchor::start, false, true});
  const double x = place.x + 92;
  draw_cross(canvas, {x, place.y + 14});
  canvas.text({x + 16, place.y + 18}, "nominal pose", {12, kInk});
  draw_ring(canvas, {x, place.y + 38});
  canvas.text({x + 16, place.y + 42}, "lowest of the plane", {12, kInk});
  const double apart = (range.high - range.low) / kContours;
  canvas.text({x - 6, place.y + 66},
              logarithmic ? "contours at factors of " + significant(std::pow(10, apart), 2)
                          : "contours every " + significant(apart, 2),
              {12, kQuietInk});
  if (const double steepest = steepest_of(landscape); steepest > 0) {
    std::vector<Segment> arrow;
    add_arrow(arrow, {x, place.y + 86}, {16, 0});
    draw_lines_of_arrows(canvas, arrow);
    canvas.text({x + 16, place.y + 90}, "towards lower values", {12, kInk});
    canvas.text({x - 6, place.y + 112}, "length: log of the slope,", {12, kQuietInk});
    canvas.text({x - 6, place.y + 130},
                significant(steepest / kSlopes, 2) + " to " + significant(steepest, 2) + " per travel",
                {12, kQuietInk});
  }
}

void draw(Canvas& canvas, Landscape landscape, const LandscapeLayout& layout) {
  if (const double from = landscape.logarithmic_from; from > 0)
    for (LandscapePlane& plane : landscape.planes)
      for (double& value : plane.values) value = std::log10(std::max(value, from));
  const Range range = range_of(landscape);
  canvas.text({kLeft, 30}, landscape.title, {18, kInk, Anchor::start, false, true});
  canvas.text({kLeft, 50}, landscape.subtitle, {12, kQuietInk});
  for (const LandscapePlane& plane : landscape.planes)
    draw_panel(canvas, landscape, plane, layout.panel(plane.across, plane.up), range);
  draw_legend(canvas, landscape, layout.legend, range);
}

}  // namespace

std::size_t LandscapePlane::lowest() const {
  return static_cast<std::size_t>(std::min_element(values.begin(), values.end()) - values.begin());
}

std::vector<std::pair<std::size_t, std::size_t>> plane_axes(std::size_t axes) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t up = 1; up < axes; ++up)
    for (std::size_t across = 0; across < up; ++across) pairs.emplace_back(across, up);
  return pairs;
}

bool has_arrow(int points, std::size_t place) {
  const auto on_grid = [&](int k) { return k > 0 && k < points - 1 && k % arrow_step(points) == 0; };
  return on_grid(static_cast<int>(place) % points) && on_grid(static_cast<int>(place) / points);
}

LandscapeLayout::LandscapeLayout(std::size_t axes) {
  const double side = static_cast<double>(axes - 1) * (kPanel + kGap) - kGap;
  const bool triangle = axes > 3;  // has a large enough free corner
  width = kLeft + side + kRight + (triangle ? 0 : 300);
  height = kTop + side + kBottom;
  const Rectangle corner = panel(triangle ? axes - 3 : axes - 2, 1);
  legend = {corner.x + (triangle ? 10 : kPanel + 40), kTop + 16, kLegendWidth, kPanel - 16};
  width = std::max(width, legend.x + 270);
}

Rectangle LandscapeLayout::panel(std::size_t across, std::size_t up) const {
  return {kLeft + static_cast<double>(across) * (kPanel + kGap), kTop + static_cast<double>(up - 1) * (kPanel + kGap),
          kPanel, kPanel};
}

std::string landscape_svg(const Landscape& landscape) {
  const LandscapeLayout layout(landscape.axes.size());
  SvgCanvas canvas(layout.width, layout.height, landscape.title);
  draw(canvas, landscape, layout);
  return canvas.take();
}

Raster landscape_raster(const Landscape& landscape, double pixels_per_unit) {
  const LandscapeLayout layout(landscape.axes.size());
  RasterCanvas canvas(layout.width, layout.height, pixels_per_unit);
  draw(canvas, landscape, layout);
  return canvas.take();
}

}  // namespace relign::drawing
