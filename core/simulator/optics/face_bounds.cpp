// Bounds of a polynomial face within a distance from the axis, from samples of its profile.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "optics/face_shape.h"

namespace relign::optics {
namespace {

constexpr int kPlacesARing = 8, kPlaces = kRings * kPlacesARing;
constexpr double kBetween = 1.1;  // margin for a polynomial up to r^32 between 256 samples

struct Profile {
  std::vector<double> sags, slopes;  // at kPlaces + 1 places, the first on the axis
  std::vector<double> bends;         // upper bounds of the second derivative between them, in any direction
};

Profile profile_of(const Face& face, double radius) {
  Profile profile;
  const double step = radius / kPlaces;
  for (int i = 0; i <= kPlaces; ++i) {
    profile.sags.push_back(sag(face, i * step));
    profile.slopes.push_back(slope(face, i * step));
  }
  const auto at = [](int i) { return static_cast<std::size_t>(std::clamp(i, 0, kPlaces - 1)); };
  std::vector<double> along;  // second derivative along r, on the middle of each step
  for (std::size_t i = 0; i < kPlaces; ++i) along.push_back((profile.slopes[i + 1] - profile.slopes[i]) / step);
  for (int i = 0; i < kPlaces; ++i) {
    const double here = along[at(i)], before = along[at(i - 1)], behind = along[at(i + 1)];
    const double radial = std::max({std::fabs(here), std::fabs(before), std::fabs(behind)}) +
                          std::max(std::fabs(here - before), std::fabs(here - behind)) / 2;
    // Around the axis: slope / r; on the axis both are the same.
    const double around = std::max(i > 0 ? std::fabs(profile.slopes[at(i)]) / (i * step) : 0,
                                   std::fabs(profile.slopes[at(i) + 1]) / ((i + 1) * step));
    profile.bends.push_back(kBetween * std::max(radial, around));
  }
  return profile;
}

// The slopes in a ring: how steeply the face rises away from the axis, and towards it.
struct Rise {
  double outwards = 0, inwards = 0;
};

FaceRings rings_of(const Profile& profile, double radius) {
  FaceRings rings{};
  std::array<Rise, kRings> rises{};
  const double step = radius / kPlaces, width = radius / kRings;
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    double low = 1e300, high = -1e300, bent = 0;
    // One sample more on either side: the ring of a ray is found with rounding.
    const std::size_t first = ring * kPlacesARing, last = first + kPlacesARing;
    for (std::size_t i = first; i <= last; ++i) {
      low = std::min(low, profile.sags[i]);
      high = std::max(high, profile.sags[i]);
      rises[ring].outwards = std::max(rises[ring].outwards, profile.slopes[i]);
      rises[ring].inwards = std::max(rises[ring].inwards, -profile.slopes[i]);
    }
    for (std::size_t i = first > 0 ? first - 1 : 0; i < std::min<std::size_t>(last + 1, kPlaces); ++i)
      bent = std::max(bent, profile.bends[i]);
    // Bounds how far sag and slope deviate between two samples.
    rings.lowest[ring] = low - bent * step * step / 8;
    rings.highest[ring] = high + bent * step * step / 8;
    rings.most_bent[ring] = bent;
    rises[ring].outwards += bent * step;
    rises[ring].inwards += bent * step;
  }
  // Lines from a point H of a ring to a higher point P are no steeper than the face in between, and no steeper than the
  // line from the lowest point of the one ring to the highest of the other over the least distance.
  constexpr double kRounding = 1e-3;
  for (std::size_t h = 0; h < kRings; ++h) {
    const double h_from = static_cast<double>(h) * width, h_to = h_from + width;
    double outside = 0, anywhere = rises[h].inwards;
    double steepest = 0;
    for (std::size_t p = h; p < kRings; ++p) {
      const double p_from = static_cast<double>(p) * width, p_to = p_from + width;
      const double higher = std::max(0.0, rings.highest[p] - rings.lowest[h]);
      steepest = std::max(steepest, rises[p].outwards);
      const double apart = p_from - h_to;
      outside = std::max(outside, apart > 0 ? std::min(steepest, higher / apart) : steepest);
      // A ray that recedes from the axis at H and was at P before has passed a point no farther from the axis than H: P
      // is at least sqrt(P^2 - H^2) away.
      const double around = steepest * std::sqrt((p_to - h_from) / (p_to + h_from));
      const double off = p_from * p_from - h_to * h_to;
      anywhere = std::max(anywhere, off > 0 ? std::min(around, higher / std::sqrt(off)) : around);
    }
    steepest = 0;
    for (std::size_t p = h + 1; p-- > 0;) {
      const double higher = std::max(0.0, rings.highest[p] - rings.lowest[h]);
      steepest = std::max(steepest, rises[p].inwards);
      const double apart = h_from - (static_cast<double>(p) + 1) * width;
      anywhere = std::max(anywhere, apart > 0 ? std::min(steepest, higher / apart) : steepest);
    }
    rings.rise_outside[h] = static_cast<float>(outside * (1 + kRounding) + kRounding);
    rings.rise_anywhere[h] = static_cast<float>(anywhere * (1 + kRounding) + kRounding);
  }
  return rings;
}

// The closer of the face's own conic and the least-squares paraboloid z = a + b r^2, weighted evenly over the area.
void find_conic_near(const Face& face, const Profile& profile, FaceBounds& bounds) {
  double n = 0, sum_q = 0, sum_qq = 0, sum_z = 0, sum_qz = 0;
  for (std::size_t i = 1; i <= kPlaces; ++i) {
    const double r = bounds.radius * static_cast<double>(i) / kPlaces, q = r * r, z = profile.sags[i];
    n += r;
    sum_q += r * q;
    sum_qq += r * q * q;
    sum_z += r * z;
    sum_qz += r * q * z;
  }
  const double b = (n * sum_qz - sum_q * sum_z) / (n * sum_qq - sum_q * sum_q), a = (sum_z - b * sum_q) / n;
  Face conic;
  conic.curvature = face.curvature;
  conic.conic = face.conic;
  double off_conic = 0, off_paraboloid = 0;
  for (std::size_t i = 0; i <= kPlaces; ++i) {
    const double r = bounds.radius * static_cast<double>(i) / kPlaces;
    const double own = sag(conic, r);
    off_conic = std::max(off_conic, std::isfinite(own) ? std::fabs(own - profile.sags[i]) : 1e300);
    off_paraboloid = std::max(off_paraboloid, std::fabs(a + b * r * r - profile.sags[i]));
  }
  bounds.near_curvature = face.curvature;
  bounds.near_conic_plus_1 = 1 + face.conic;
  if (!(off_paraboloid < off_conic)) return;
  bounds.near_vertex = a;
  bounds.near_curvature = 2 * b;
  bounds.near_conic_plus_1 = 0;
}

}  // namespace

FaceBounds bounds_of(const Face& face, double radius) {
  FaceBounds bounds;
  bounds.radius = radius;
  const Profile profile = profile_of(face, radius);
  const FaceRings rings = rings_of(profile, radius);
  bounds.lowest = *std::min_element(rings.lowest, rings.lowest + kRings);
  bounds.highest = *std::max_element(rings.highest, rings.highest + kRings);
  bounds.most_bent = *std::max_element(rings.most_bent, rings.most_bent + kRings);
  for (const double here : profile.slopes) bounds.steepest = std::max(bounds.steepest, std::fabs(here));
  bounds.steepest *= kBetween;
  bounds.rings = std::make_shared<const FaceRings>(rings);
  find_conic_near(face, profile, bounds);
  return bounds;
}

}  // namespace relign::optics
