// Marks of a chart in an image: dark squares on white.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace field_focus {

struct Mark {
  double x_px, y_px;  // centre
  double side_px;
};

// Pixels row by row. A mark is a connected dark area that fills at least 70 % of its bounding box, which crosses do
// not, and that touches neither the border of the image nor pixels that were not read out, which are 0 like the inside
// of a mark but have no white around them.
inline std::vector<Mark> find_marks(const std::vector<float>& pixels, std::size_t width, std::size_t height) {
  constexpr double kFilled = 0.7;
  constexpr std::size_t kSmallest = 8;  // pixels a side
  std::vector<float> sorted = pixels;
  const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() - 1 - sorted.size() / 100);
  std::nth_element(sorted.begin(), high, sorted.end());
  const float threshold = 0.5F * *high;
  std::vector<char> seen(pixels.size());
  std::vector<std::size_t> area;
  std::vector<Mark> marks;
  for (std::size_t first = 0; first < pixels.size(); ++first) {
    if (seen[first] || !(pixels[first] < threshold)) continue;
    std::size_t left = width, right = 0, top = height, bottom = 0;
    double sum_x = 0, sum_y = 0;
    area.assign(1, first);
    seen[first] = 1;
    for (std::size_t i = 0; i < area.size(); ++i) {
      const std::size_t x = area[i] % width, y = area[i] / width;
      left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
      sum_x += static_cast<double>(x), sum_y += static_cast<double>(y);
      const auto visit = [&](bool inside, std::size_t next) {
        if (!inside || seen[next] || !(pixels[next] < threshold)) return;
        seen[next] = 1;
        area.push_back(next);
      };
      visit(x > 0, area[i] - 1);
      visit(x + 1 < width, area[i] + 1);
      visit(y > 0, area[i] - width);
      visit(y + 1 < height, area[i] + width);
    }
    const std::size_t columns = right - left + 1, rows = bottom - top + 1;
    if (left == 0 || top == 0 || right + 1 == width || bottom + 1 == height) continue;
    const auto count = static_cast<double>(area.size()), box = static_cast<double>(columns * rows);
    if (std::min(columns, rows) < kSmallest || 2 * std::min(columns, rows) < std::max(columns, rows)) continue;
    if (count < kFilled * box) continue;
    marks.push_back({sum_x / count, sum_y / count, std::sqrt(count)});
  }
  return marks;
}

// Part of the image that a specification limits by itself.
enum class Part { centre, corner, other };

inline Part part_of(const Mark& mark, double half_width, double half_height) {
  constexpr double kMiddle = 0.2, kOuter = 0.6;  // shares of the half image: centre within, corners beyond
  const double x = std::fabs(mark.x_px - half_width), y = std::fabs(mark.y_px - half_height);
  if (std::hypot(x, y) < kMiddle * half_width) return Part::centre;
  return x > kOuter * half_width && y > kOuter * half_height ? Part::corner : Part::other;
}

struct Region {
  int x, y, width, height;  // pixels
};

// The two opposite edges of a mark, left and right or above and below, without the mark's corners. MTF changes over a
// mark: the mean of both edges is that at its middle. Of a mark near the border, only the edge that is inside the image
// wherever the mark is, up to `spare` pixels from its place.
inline std::vector<Region> edges_of(const Mark& mark, const Mark& place, bool upright, double spare, double image_width,
                                    double image_height) {
  constexpr double kAlong = 0.8, kAcross = 0.55;  // of the side
  const double width = (upright ? kAcross : kAlong) * mark.side_px,
               height = (upright ? kAlong : kAcross) * mark.side_px;
  std::vector<Region> edges;
  for (const double side : {-0.5, 0.5}) {
    const auto left = [&](const Mark& of) { return of.x_px + (upright ? side * of.side_px : 0) - 0.5 * width; };
    const auto top = [&](const Mark& of) { return of.y_px + (upright ? 0 : side * of.side_px) - 0.5 * height; };
    if (left(place) >= spare && top(place) >= spare && left(place) + width + spare <= image_width &&
        top(place) + height + spare <= image_height)
      edges.push_back({static_cast<int>(left(mark)), static_cast<int>(top(mark)), static_cast<int>(width),
                       static_cast<int>(height)});
  }
  return edges;
}

// The mark nearest to a place, if within `most` pixels; null otherwise.
inline const Mark* nearest(const std::vector<Mark>& marks, double x, double y, double most) {
  const Mark* found = nullptr;
  for (const Mark& mark : marks)
    if (const double away = std::hypot(mark.x_px - x, mark.y_px - y); away < most) most = away, found = &mark;
  return found;
}

}  // namespace field_focus
