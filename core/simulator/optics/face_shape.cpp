#include "optics/face_shape.h"

#include <algorithm>
#include <cmath>

#include "optics/elementary.h"
#include "optics/first_rise.h"

namespace relign::optics {
namespace {

// Height, and its derivative with respect to r^2.
struct Height {
  double z = 0;
  double slope = 0;
};

Height height(const Face& face, double r2) {
  const double c = face.curvature, kappa_c2 = (1 + face.conic) * c * c;
  const double root = std::sqrt(1 - kappa_c2 * r2);
  Height result{c * r2 / (1 + root) + face.r2_term * r2, c / (2 * root) + face.r2_term};
  double power = r2;  // r^2(i - 1)
  for (std::size_t i = 0; i < face.even_asphere.size(); ++i) {
    const auto exponent = static_cast<double>(i + 2);
    result.slope += exponent * face.even_asphere[i] * power;
    power *= r2;
    result.z += face.even_asphere[i] * power;
  }
  if (!face.odd_asphere.empty()) {
    power = std::sqrt(r2);
    for (std::size_t i = 0; i < face.odd_asphere.size(); ++i) {
      const double exponent = static_cast<double>(i) + 1.5;
      result.slope += exponent * face.odd_asphere[i] * power;
      power *= r2;
      result.z += face.odd_asphere[i] * power;
    }
  }
  if (!face.over_root.empty()) {
    double sum = 0, derivative = 0;
    power = 1;
    for (std::size_t i = 0; i < face.over_root.size(); ++i) {
      derivative += static_cast<double>(i + 1) * face.over_root[i] * power;
      power *= r2;
      sum += face.over_root[i] * power;
    }
    result.z += sum / root;
    result.slope += derivative / root + sum * kappa_c2 / (2 * root * root * root);
  }
  return result;
}

std::optional<FacePoint> intersect_conic(const Face& face, const Vec3& m, const Vec3& l) {
  const double c = face.curvature, kappa = 1 + face.conic;
  // The conic c (x^2 + y^2 + kappa z^2) = 2 z along the ray: a t^2 - 2 b t + f = 0. The root near the vertex has
  // the denominator that does not vanish there.
  const double a = c * (1 + face.conic * l.z * l.z);
  const double b = l.z - c * (m.x * l.x + m.y * l.y + kappa * m.z * l.z);
  const double f = c * (m.x * m.x + m.y * m.y + kappa * m.z * m.z) - 2 * m.z;
  const double discriminant = b * b - a * f;
  if (!(discriminant > 0)) return std::nullopt;
  const double t = f / (b + std::copysign(std::sqrt(discriminant), l.z));
  FacePoint point;
  point.at = m + t * l;
  const double root = 1 - kappa * c * point.at.z;  // of the height; negative on the conic's other half
  if (!(root > 0)) return std::nullopt;
  point.normal = unit({-c * point.at.x, -c * point.at.y, root});
  return point;
}

// The interval of t in which a line m + t l is inside a cylinder and a slab; empty if low > high.
struct Interval {
  double low = -1e30, high = 1e30;

  void keep(double one_end, double other_end) {
    low = std::max(low, std::min(one_end, other_end));
    high = std::min(high, std::max(one_end, other_end));
  }
};

Interval near_face(const FaceBounds& bounds, const Vec3& m, const Vec3& l) {
  constexpr double kSlack = 1e-9;  // mm: rounding must not lose rays that graze the border
  Interval interval;
  const double across = l.x * l.x + l.y * l.y, along = m.x * l.x + m.y * l.y;
  const double beside = bounds.radius * bounds.radius - m.x * m.x - m.y * m.y;
  if (across > 0) {
    const double discriminant = along * along + across * beside;
    if (!(discriminant >= 0)) return {1, -1};
    const double root = std::sqrt(discriminant);
    interval.keep((-along - root) / across, (-along + root) / across);
  } else if (beside < 0) {
    return {1, -1};
  }
  if (l.z != 0) interval.keep((bounds.lowest - kSlack - m.z) / l.z, (bounds.highest + kSlack - m.z) / l.z);
  return interval;
}

// Power series as lists of coefficients, lowest first.
using Series = std::vector<double>;

void add_scaled(Series& sum, double factor, const Series& other) {
  sum.resize(std::max(sum.size(), other.size()));
  for (std::size_t i = 0; i < other.size(); ++i) sum[i] += factor * other[i];
}

Series times_linear(const Series& series, double constant, double linear) {  // (constant + linear x) series
  Series product(series.size() + 1);
  for (std::size_t i = 0; i < series.size(); ++i) {
    product[i] += constant * series[i];
    product[i + 1] += linear * series[i];
  }
  return product;
}

// From powers of u^2 = (r / radius)^2, beginning with u^(2 first), to powers of r.
Series in_powers_of_r(const Series& of_u2, std::size_t first, double radius, double scale = 1) {
  Series terms;
  for (std::size_t i = 0; i < first; ++i) scale /= radius * radius;
  for (const double term : of_u2) {
    terms.push_back(term * scale);
    scale /= radius * radius;
  }
  return terms;
}

}  // namespace

double sag(const Face& face, double radius) { return height(face, radius * radius).z; }
double slope(const Face& face, double radius) { return 2 * radius * height(face, radius * radius).slope; }

double valid_radius(const Face& face) {
  constexpr double kKnown_mm = 1e-5;  // smaller semi-diameters are placeholders
  constexpr double kStep = 1.05, kMaxGrowth = 2, kFarthest_mm = 1e6;
  constexpr double kSteepest = 3;     // 72 degrees
  constexpr double kMinRoot2 = 0.02;  // of the conic
  const double clear = std::max(face.clear_radius_mm, face.listing_clear_radius_mm);
  const double farthest = clear > kKnown_mm ? kMaxGrowth * clear : kFarthest_mm;
  const double kappa_c2 = (1 + face.conic) * face.curvature * face.curvature;
  double radius = clear;
  while (radius * kStep <= farthest) {
    const double next = radius * kStep;
    if (!(1 - kappa_c2 * next * next > kMinRoot2) || !(std::fabs(slope(face, next)) < kSteepest)) break;
    radius = next;
  }
  return radius;
}

std::optional<FacePoint> intersect(const Face& face, const FaceBounds& bounds, const Vec3& p, const Vec3& l) {
  // From the point of the line closest to the vertex, so that distant starts lose no digits.
  const Vec3 m = p - dot(p, l) * l;
  if (face.is_conic()) return intersect_conic(face, m, l);
  const Interval interval = near_face(bounds, m, l);
  if (!(interval.low <= interval.high)) return std::nullopt;
  const double forwards = l.z < 0 ? -1 : 1;
  double slope_over_r2 = 0;
  const auto behind = [&](double t, double& derivative) {  // how far behind the face, along the light
    const Vec3 at = m + t * l;
    const Height here = height(face, at.x * at.x + at.y * at.y);
    slope_over_r2 = 2 * here.slope;
    derivative = forwards * (l.z - slope_over_r2 * (at.x * l.x + at.y * l.y));
    return forwards * (at.z - here.z);
  };
  const std::optional<double> t = first_rise_over_rings(behind, RayOverFace(m, l), *bounds.rings, bounds.radius,
                                                        interval.low, interval.high, kRoundingOfDouble);
  if (!t) return std::nullopt;
  FacePoint point;
  point.at = m + *t * l;
  double unused = 0;
  behind(*t, unused);
  point.normal = unit({-slope_over_r2 * point.at.x, -slope_over_r2 * point.at.y, 1});
  return point;
}

std::vector<double> even_terms_of_q_con(const std::vector<double>& coefficients, double radius) {
  // P_m^(0,4)(y) with y = 2 x - 1, by the recurrence of Jacobi polynomials (Abramowitz and Stegun, 22.7).
  constexpr double b = 4;
  Series sum, before, here{1};
  for (std::size_t m = 0; m < coefficients.size(); ++m) {
    add_scaled(sum, coefficients[m], here);
    const auto n = static_cast<double>(m);
    Series next;
    if (m == 0) {
      next = {-1 - b, b + 2};  // ((2 + b) y - b) / 2
    } else {
      const double s = 2 * n + b;
      const double below = 2 * (n + 1) * (n + 1 + b) * s, y = (s + 1) * (s + 2) * s, constant = -(s + 1) * b * b;
      next = times_linear(here, (constant - y) / below, 2 * y / below);
      add_scaled(next, -2 * n * (n + b) * (s + 2) / below, before);
    }
    before = here;
    here = next;
  }
  return in_powers_of_r(sum, 2, radius);
}

std::optional<std::vector<double>> over_root_terms_on_conic(const std::vector<double>& over_root, double curvature,
                                                            double conic, double reach) {
  constexpr double kAllowed_mm = 1e-6;
  constexpr int kNodes = 64, kPlaces = 500;
  constexpr std::size_t kMaxTerms = 16;  // b2 to b32
  const double c2 = curvature * curvature, reach2 = reach * reach;
  if (!(1 - conic * c2 * reach2 > 0)) return std::nullopt;
  // Of x = (r / reach)^2, without the factor r^2.
  const auto exact = [&](double x) {
    double sum = 0;
    for (std::size_t i = over_root.size(); i-- > 0;) sum = sum * reach2 * x + over_root[i];
    return sum * std::sqrt(1 - conic * c2 * reach2 * x);
  };
  // Chebyshev series over 0 to 1, truncated when accurate enough, in powers of x.
  std::vector<double> chebyshev(kMaxTerms);
  for (int node = 0; node < kNodes; ++node) {
    const double angle = (node + 0.5) * kPi / kNodes, value = exact((1 + std::cos(angle)) / 2);
    for (std::size_t n = 0; n < kMaxTerms; ++n)
      chebyshev[n] += (n == 0 ? 1.0 : 2.0) / kNodes * value * std::cos(static_cast<double>(n) * angle);
  }
  Series sum, before{1}, here{-1, 2};
  for (std::size_t n = 0; n < kMaxTerms; ++n) {
    add_scaled(sum, chebyshev[n], before);
    Series next = times_linear(here, -2, 4);
    add_scaled(next, -1, before);
    before = here;
    here = next;
    double largest = 0;
    for (int i = 0; i <= kPlaces; ++i) {
      const double x = static_cast<double>(i) / kPlaces, root2 = 1 - (1 + conic) * c2 * reach2 * x;
      double fitted = 0;
      for (std::size_t k = sum.size(); k-- > 0;) fitted = fitted * x + sum[k];
      if (root2 > 0) largest = std::max(largest, std::fabs(fitted - exact(x)) * reach2 * x / std::sqrt(root2));
    }
    if (largest < kAllowed_mm) return in_powers_of_r(sum, 1, reach, reach2);
  }
  return std::nullopt;
}

std::vector<double> over_root_terms_of_q_bfs(const std::vector<double>& coefficients, double radius) {
  // Forbes, Optics Express 18, 19700 (2010), eqs. (A.14) to (A.16): P_m from P_m-1 and P_m-2 of x = u^2, and Q_m from
  // f_m Q_m = P_m - g_m-1 Q_m-1 - h_m-2 Q_m-2.
  Series sum;
  std::vector<Series> p, q;
  std::vector<double> f, g, h;
  for (std::size_t m = 0; m < coefficients.size(); ++m) {
    const auto n = static_cast<double>(m);
    if (m == 0) {
      p.push_back({2});
      f.push_back(2);
      q.push_back({1});
    } else if (m == 1) {
      p.push_back({6, -8});
      g.push_back(-0.5);
      f.push_back(std::sqrt(19.0) / 2);
      q.push_back({13 / std::sqrt(19.0), -16 / std::sqrt(19.0)});
    } else {
      Series next = times_linear(p[m - 1], 2, -4);
      add_scaled(next, -1, p[m - 2]);
      p.push_back(next);
      h.push_back(-n * (n - 1) / (2 * f[m - 2]));
      g.push_back(-(1 + g[m - 2] * h[m - 2]) / f[m - 1]);
      f.push_back(std::sqrt(n * (n + 1) + 3 - g[m - 1] * g[m - 1] - h[m - 2] * h[m - 2]));
      Series own = p[m];
      add_scaled(own, -g[m - 1], q[m - 1]);
      add_scaled(own, -h[m - 2], q[m - 2]);
      for (double& term : own) term /= f[m];
      q.push_back(own);
    }
    add_scaled(sum, coefficients[m], q[m]);
  }
  return in_powers_of_r(times_linear(sum, 1, -1), 1, radius);  // u^2 (1 - u^2)
}

}  // namespace relign::optics
