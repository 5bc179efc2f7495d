#include "imaging/target_shapes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "optics/elementary.h"

namespace relign::imaging {
namespace {

using optics::kPi;

// Positive right of the edge from a to b, as displayed with y downwards: inside a clockwise polygon.
double side_of(const Place& a, const Place& b, const Place& p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

double area_of(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Place &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - b.x * a.y;
  }
  return twice / 2;
}

// The part of `polygon` on the inner side of one edge (Sutherland and Hodgman).
void cut(const Polygon& polygon, const Place& a, const Place& b, Polygon& part) {
  part.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Place &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    const double s = side_of(a, b, from), t = side_of(a, b, to);
    if (s >= 0) part.push_back(from);
    if ((s > 0 && t < 0) || (s < 0 && t > 0)) {
      const double share = s / (s - t);
      part.push_back({from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)});
    }
  }
}

}  // namespace

Polygon rectangle(double left, double top, double width, double height) {
  return {{left, top}, {left + width, top}, {left + width, top + height}, {left, top + height}};
}

Polygon turned_square(const Place& centre, double side, double angle_deg) {
  const optics::SineCosine turn = optics::sine_cosine_of_degrees(angle_deg);
  Polygon square = rectangle(-side / 2, -side / 2, side, side);
  for (Place& corner : square)
    corner = {centre.x + turn.cosine * corner.x - turn.sine * corner.y,
              centre.y + turn.sine * corner.x + turn.cosine * corner.y};
  return square;
}

Polygon disc(const Place& centre, double diameter) {
  constexpr int kCorners = 72;
  const double corner_sine = optics::sine_cosine_of_degrees(360.0 / kCorners).sine;
  const double radius = diameter / 2 * std::sqrt(2 * kPi / (kCorners * corner_sine));
  Polygon polygon;
  for (int k = 0; k < kCorners; ++k) {
    const optics::SineCosine angle = optics::sine_cosine_of_degrees(360.0 * k / kCorners);
    polygon.push_back({centre.x + radius * angle.cosine, centre.y + radius * angle.sine});
  }
  return polygon;
}

void paint(images::Image& bitmap, const Polygon& shape) {
  const auto side = static_cast<double>(bitmap.width);
  Polygon scaled = shape;
  double left = side, top = side, right = 0, bottom = 0;
  for (Place& corner : scaled) {
    corner = {corner.x * side, corner.y * side};
    left = std::min(left, corner.x);
    right = std::max(right, corner.x);
    top = std::min(top, corner.y);
    bottom = std::max(bottom, corner.y);
  }
  const auto texel = [&](double place) { return static_cast<std::size_t>(std::clamp(place, 0.0, side)); };
  Polygon piece, part;
  for (std::size_t y = texel(top); y < texel(std::ceil(bottom)); ++y)
    for (std::size_t x = texel(left); x < texel(std::ceil(right)); ++x) {
      piece.clear();
      for (const auto& [right_of, below] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{1, 1}, std::pair{0, 1}})
        piece.push_back({static_cast<double>(x) + right_of, static_cast<double>(y) + below});
      // Skips edges that do not cross the texel: most texels are never cut.
      for (std::size_t i = 0; i < scaled.size() && !piece.empty(); ++i) {
        const Place &a = scaled[i], &b = scaled[(i + 1) % scaled.size()];
        const bool whole =
            std::all_of(piece.begin(), piece.end(), [&](const Place& corner) { return side_of(a, b, corner) >= 0; });
        if (whole) continue;
        cut(piece, a, b, part);
        piece.swap(part);
      }
      bitmap.at(x, y) += static_cast<float>(area_of(piece));
    }
}

}  // namespace relign::imaging
