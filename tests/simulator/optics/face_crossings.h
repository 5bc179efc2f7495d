// Intersections of rays with polynomial faces by exhaustive search: the reference for face_shape.h and the block
// kernels.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <relign/random.hpp>
#include <string>

#include "optics/backward_path.h"
#include "optics/face_shape.h"
#include "optics/ray_block.h"

namespace relign::optics {

// The first crossing within the semi-diameter, by `places` samples of the line and bisection; uses only sag().
inline std::optional<double> first_crossing(const Face& face, const Vec3& p, const Vec3& l, int places = 2000) {
  const double across = l.x * l.x + l.y * l.y, along = p.x * l.x + p.y * l.y, radius = face.clear_radius_mm;
  const double discriminant = along * along - across * (p.x * p.x + p.y * p.y - radius * radius);
  if (discriminant < 0) return std::nullopt;
  const double from = (-along - std::sqrt(discriminant)) / across, to = (-along + std::sqrt(discriminant)) / across;
  const auto behind = [&](double t) {
    const Vec3 at = p + t * l;
    return (l.z < 0 ? -1 : 1) * (at.z - sag(face, std::min(radius, std::hypot(at.x, at.y))));
  };
  double before = from, value = behind(from);
  for (int i = 1; i <= places; ++i) {
    double here = from + (to - from) * i / places;
    const double value_here = behind(here);
    if (value < 0 && value_here >= 0) {
      for (int k = 0; k < 80; ++k) {
        const double middle = (before + here) / 2;
        (behind(middle) < 0 ? before : here) = middle;
      }
      return here;
    }
    before = here;
    value = value_here;
  }
  return std::nullopt;
}

struct Crossings {
  long hits = 0, misses = 0;
  long several = 0;    // rays that pass through the face more than once
  long grazing = 0;    // earlier hits than sampled: entry and exit between two samples
  long shallow = 0;    // hits that rounding of the sag moves by more than 1e-12 mm along the face
  long in_blocks = 0;  // rays that blocks were compared for
};

// Steep rays about a face: towards +z or -z.
inline void steep_ray(Random& random, const Face& face, double way, Vec3& p, Vec3& l) {
  const double side = 1.16 * face.clear_radius_mm;
  l = unit({random.uniform(-2, 2), random.uniform(-2, 2), way});
  p = {random.uniform(-side, side), random.uniform(-side, side), random.uniform(-0.5, 0.5) * face.clear_radius_mm};
}

// Checks that intersect() finds every hit and no others, to 1e-12 mm. Stops at the first mistake.
inline void compare_with_bisection(const Face& face, int rays, std::uint64_t seed, const std::string& what,
                                   Crossings& sum) {
  const FaceBounds bounds = bounds_of(face, face.clear_radius_mm);
  Random random(seed);
  for (int i = 0; i < rays; ++i) {
    Vec3 p, l;
    steep_ray(random, face, i % 2 == 0 ? 1 : -1, p, l);
    const std::optional<double> expected = first_crossing(face, p, l);
    const std::optional<FacePoint> met = intersect(face, bounds, p, l);
    // Between two samples a ray may enter and leave: an additional, earlier hit.
    if (met && (!expected || dot(met->at - p, l) < *expected - 1e-9)) {
      const double r = std::hypot(met->at.x, met->at.y);
      ASSERT_LT(std::fabs(met->at.z - sag(face, r)), 1e-12) << what << ", ray " << i;
      ASSERT_LE(r, face.clear_radius_mm + 1e-9) << what << ", ray " << i;
      ++sum.grazing;
      continue;
    }
    ASSERT_EQ(expected.has_value(), met.has_value()) << what << ", ray " << i;
    if (!met) {
      ++sum.misses;
      continue;
    }
    ++sum.hits;
    const Vec3 off = met->at - (p + *expected * l);
    const double apart = std::sqrt(dot(off, off));
    if (apart >= 1e-12) {
      ASSERT_LT(std::fabs(met->at.z - sag(face, std::hypot(met->at.x, met->at.y))), 1e-12) << what << ", ray " << i;
      ASSERT_LT(apart, 1e-9) << what << ", ray " << i;
      ++sum.shallow;
    }
    // Backwards along the same line the first crossing is the last forwards.
    const std::optional<FacePoint> last = intersect(face, bounds, p, -1.0 * l);
    sum.several += last && std::fabs(dot(last->at - met->at, l)) > 1e-6 ? 1 : 0;
  }
}

// The same for a block operation with its bounds, against intersect(): its hits must be the first, except for rays that
// graze the face or its rim within float precision.
inline void compare_blocks(const BlockKernels& kernels, const Op& given, const Face& face, const FaceBounds& bounds,
                           int rays, std::uint64_t seed, const std::string& what, Crossings& sum) {
  Op op = given;
  op.vertex_z = 0;
  op.index_before = op.index_after = op.index_ratio = 1;
  const double radius = face.clear_radius_mm;
  op.clear_radius2 = static_cast<float>(radius * radius);
  const auto block = std::make_unique<RayBlock>();
  Random random(seed);
  for (int first = 0; first < rays; first += kBlockRays) {
    Vec3 starts[kBlockRays], ways[kBlockRays];
    for (int i = 0; i < kBlockRays; ++i) {
      Vec3 p, l;
      steep_ray(random, face, -1, p, l);
      put_ray(*block, i, p, l);
      const auto of = [](float value) { return static_cast<double>(value); };
      starts[i] = {of(block->x[i]), of(block->y[i]), of(block->z[i])};
      ways[i] = unit({of(block->lx[i]), of(block->ly[i]), of(block->lz[i])});
    }
    kernels.trace(*block, &op, 1, false, kBlockRays);
    for (int i = 0; i < kBlockRays; ++i) {
      const std::optional<FacePoint> met = intersect(face, bounds, starts[i], ways[i]);
      const Vec3 at{static_cast<double>(block->x[i]), static_cast<double>(block->y[i]),
                    static_cast<double>(block->z[i])};
      const double rim = 1e-3 * radius;
      const double r = met ? std::hypot(met->at.x, met->at.y) : std::hypot(at.x, at.y);
      // Float coefficients shift a steep asphere by up to 1e-4 radii: shallower hits may be misses.
      const int ring = std::min(kRings - 1, static_cast<int>(std::min(1.0, r / radius) * kRings));
      const double grazing = std::max(0.02, std::sqrt(2e-4 * radius * bounds.rings->most_bent[ring]));
      if (met && (-dot(met->normal, ways[i]) < grazing || r > radius - rim)) continue;
      const bool hit = block->margin[i] > 0;
      if (!met && hit) {  // beyond the rim, or grazing?
        const double found = std::hypot(at.x, at.y), slope_here = slope(face, found);
        const Vec3 normal =
            unit({-slope_here * at.x / std::max(found, 1e-12), -slope_here * at.y / std::max(found, 1e-12), 1});
        if (found > radius - rim || std::fabs(dot(normal, ways[i])) < grazing) continue;
      }
      ++sum.in_blocks;
      ASSERT_EQ(hit, met.has_value()) << what << ", " << kernels.name << ", ray " << first + i << ": from "
                                      << starts[i].x << ", " << starts[i].y << ", " << starts[i].z << " along "
                                      << ways[i].x << ", " << ways[i].y << ", " << ways[i].z << ", at " << at.x << ", "
                                      << at.y << ", " << at.z << ", semi-diameter " << radius;
      if (!met) continue;
      const Vec3 off = at - met->at;
      // Newton's last step starts at up to 1e-4 radii from the face, which is more along a grazing ray.
      const double cosine = -dot(met->normal, ways[i]);
      ASSERT_LT(std::sqrt(dot(off, off)) * cosine, 2e-4 * radius)
          << what << ", " << kernels.name << ", ray " << first + i;
    }
  }
}

}  // namespace relign::optics
