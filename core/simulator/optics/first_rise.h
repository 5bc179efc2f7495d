// The first upward zero crossing of a function with bounded second derivative: intersects rays with aspheres, in
// face_shape.cpp and in the block kernels' slow path.
#pragma once

#include <cmath>
#include <optional>

#include "optics/face_rings.h"

namespace relign::optics {

constexpr double kRoundingOfDouble = 4e-16;

// The first t in [from, to] at which g crosses 0 from below; empty if there is none (touching 0 does not count).
// `most_bent` bounds |g''|: each step ends where a parabola of that curvature could first be 0, so that no zero is
// skipped, and steps converge like Newton's. g(t, derivative) returns the value and sets the derivative. `below`:
// whether g was below 0 before `from`, and on return before the end. `rounding`: of t, relative.
template <class Function>
std::optional<double> first_rise(const Function& g, double from, double to, double most_bent, bool& below,
                                 double rounding) {
  constexpr int kMaxSteps = 200;
  constexpr double kOver = 1e-9;  // least step beyond a downward zero crossing
  const double bent = std::fmax(most_bent, 1e-9);
  double t = from;
  for (int k = 0; k < kMaxSteps && t <= to; ++k) {
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
      // To where value + slope h - bent h^2 / 2 is 0, and slightly beyond.
      const double root = std::sqrt(slope * slope + 2 * bent * value);
      const double step = slope < 0 ? 2 * value / (root - slope) : (slope + root) / bent;
      t += std::fmax(step, kOver);
    }
  }
  return std::nullopt;
}

// A line p + t l in coordinates with the origin at the vertex of a face.
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

// The same for g(t) = distance of the ray behind the face, ring by ring: each ring has its own bound, and rings that
// the ray crosses in front of the face are skipped. `radius`: of the outermost ring.
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
