#include "optics/face_shape.h"

#include <cmath>

namespace relign::optics {
namespace {

constexpr int kMostSteps = 30;
constexpr double kConverged = 1e-13;  // mm along the ray
constexpr double kGoodEnough = 1e-10;

// Height, and slope of the height over r^2.
struct Height {
  double z = 0;
  double slope = 0;
};

Height height(const Face& face, double r2) {
  const double c = face.curvature;
  const double root = std::sqrt(1 - (1 + face.conic) * c * c * r2);
  Height result{c * r2 / (1 + root), c / (2 * root)};
  double power = r2;  // r^2(i - 1)
  for (std::size_t i = 0; i < face.even_asphere.size(); ++i) {
    const auto exponent = static_cast<double>(i + 2);
    result.slope += exponent * face.even_asphere[i] * power;
    power *= r2;
    result.z += face.even_asphere[i] * power;
  }
  return result;
}

}  // namespace

double sag(const Face& face, double radius) { return height(face, radius * radius).z; }

std::optional<FacePoint> meet(const Face& face, const Vec3& p, const Vec3& l) {
  // From the place nearest to the vertex, so that far starts cost no digits.
  const Vec3 m = p - dot(p, l) * l;
  const double c = face.curvature, kappa = 1 + face.conic;
  // The conic c (x^2 + y^2 + kappa z^2) = 2 z along the ray: a t^2 - 2 b t + f = 0. The root near the vertex has
  // the denominator that does not vanish there.
  const double a = c * (1 + face.conic * l.z * l.z);
  const double b = l.z - c * (m.x * l.x + m.y * l.y + kappa * m.z * l.z);
  const double f = c * (m.x * m.x + m.y * m.y + kappa * m.z * m.z) - 2 * m.z;
  const double discriminant = b * b - a * f;
  const bool conic_alone = face.even_asphere.empty();
  if (!(discriminant > 0) && conic_alone) return std::nullopt;
  double t = f / (b + std::copysign(std::sqrt(std::fmax(discriminant, 0)), l.z));
  FacePoint point;
  if (conic_alone) {
    point.at = m + t * l;
    const double root = 1 - kappa * c * point.at.z;  // of the height; negative on the conic's other half
    if (!(root > 0)) return std::nullopt;
    point.normal = unit({-c * point.at.x, -c * point.at.y, root});
    return point;
  }
  double step = 1;
  double slope = 0;
  for (int k = 0; k < kMostSteps && std::fabs(step) > kConverged; ++k) {
    point.at = m + t * l;
    const Height here = height(face, point.at.x * point.at.x + point.at.y * point.at.y);
    slope = 2 * here.slope;
    step = (point.at.z - here.z) / (l.z - slope * (point.at.x * l.x + point.at.y * l.y));
    t -= step;
  }
  if (!(std::fabs(step) < kGoodEnough)) return std::nullopt;
  point.normal = unit({-slope * point.at.x, -slope * point.at.y, 1});
  return point;
}

}  // namespace relign::optics
