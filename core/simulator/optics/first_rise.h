// The first zero of a function whose second derivative is bounded: how rays meet aspheres, in face_shape.cpp and in the
// block kernels' slow path.
#pragma once

#include <cmath>
#include <optional>

#include "optics/face_rings.h"

namespace relign::optics {

constexpr double kRoundingOfDouble = 4e-16;

// The first t in [from, to] at which g passes through 0 from below. `most_bent` bounds |g''|: each step goes as far as
// the parabola of that bend leaves no zero behind, so that none is stepped over, and the steps converge as Newton's
// do. g(t, derivative) gives the value and writes the derivative. Empty when there is no such t; a g that only touches
// 0 has none. `below`: whether g was below 0 before, and afterwards. `rounding`: of t, relative.
template <class Function>
std::optional<double> first_rise(const Function& g, double from, double to, double most_bent, bool& below,
                                 double rounding) {
  constexpr int kMostSteps = 200;
  constexpr double kOver = 1e-9;  // to the other side of a zero that leads down
  const double bent = std::fmax(most_bent, 1e-9);
  double t = from;
  for (int k = 0; k < kMostSteps && t <= to; ++k) {
    double slope = 0;
    const double value = g(t, slope);
    if (value < 0 || (value == 0 && slope > 0)) {
      below = true;
      // No earlier than where value + slope h + bent h^2 / 2 is 0.
      const double root = std::sqrt(slope * slope - 2 * bent * value);
      const double step = slope > 0 ? -2 * value / (slope + root) : (root - slope) / bent;
      t += step;
      if (slope > 0 && step <= rounding * (1 + std::fabs(t))) return t;
    } else {
      if (below) return slope > 0 ? t - value / slope : t;  // the last step ended on the zero, but for rounding
      // On to where value + slope h - bent h^2 / 2 is 0, and a little farther.
      const double root = std::sqrt(slope * slope + 2 * bent * value);
      const double step = slope < 0 ? 2 * value / (root - slope) : (slope + root) / bent;
      t += std::fmax(step, kOver);
    }
  }
  return std::nullopt;
}

// A line p + t l over a face, which has its vertex as origin.
struct RayOverFace {
  double z, lz;
  double across;   // squared sine of the angle with the axis
  double nearest;  // t of the place nearest to the axis,
  double near2;    // and its distance from it, squared

  template <class Vector>
  RayOverFace(const Vector& p, const Vector& l) : z(p.z), lz(l.z), across(l.x * l.x + l.y * l.y) {
    const double along = p.x * l.x + p.y * l.y;
    nearest = across > 0 ? -along / across : 0;
    near2 = std::fmax(p.x * p.x + p.y * p.y - nearest * nearest * across, 0);
  }
};

// The same for g(t), how far the ray is behind the face, ring by ring: each bends as little as it does, and rings that
// the ray passes before the face are not looked at. The face within `radius`, rays of [from, to].
template <class Function>
std::optional<double> first_rise_over_rings(const Function& g, const RayOverFace& ray, const FaceRings& rings,
                                            double radius, double from, double to, double rounding) {
  const double width = radius / kRings;
  const auto distance2 = [&](double t) { return ray.near2 + (t - ray.nearest) * (t - ray.nearest) * ray.across; };
  const auto t_at = [&](int ring) {  // from the place nearest to the axis to where ring `ring` begins; < 0: nowhere
    const double left = ring * width * (ring * width) - ray.near2;
    return left > 0 ? std::sqrt(left / ray.across) : -1;
  };
  bool below = false;
  bool inwards = from < ray.nearest;
  int ring = static_cast<int>(std::fmin(std::sqrt(distance2(from)) / width, kRings - 1));
  for (double t = from; t <= to;) {
    double end = to;
    int next = ring;
    if (ray.across > 0) {
      const double back = inwards ? t_at(ring) : -1;
      inwards = back >= 0;
      next = inwards ? ring - 1 : ring + 1;
      const double border = ray.nearest + (inwards ? -back : std::fmax(t_at(ring + 1), 0));
      end = next >= kRings ? to : std::fmin(to, border);
    }
    const double z_end = ray.z + end * ray.lz;
    const bool before = ray.lz < 0 ? z_end > rings.highest[ring] : z_end < rings.lowest[ring];
    if (before) {
      below = true;
    } else if (const auto found = first_rise(g, t, end, rings.most_bent[ring] * ray.across, below, rounding)) {
      return found;
    }
    if (end >= to) break;
    t = std::fmax(t, end);
    ring = next;
  }
  return std::nullopt;
}

}  // namespace relign::optics
