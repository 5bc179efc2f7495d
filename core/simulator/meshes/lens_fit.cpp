#include "meshes/lens_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

#include "base/error.h"
#include "meshes/smooth.h"

namespace relign::meshes {
namespace {

constexpr std::size_t kMinFittedCorners = 8;
constexpr double kDegreesPerRadian = 57.29577951308232;

// The sphere (or plane) that crosses the axis at z with normal (lx, ly, lz): unknowns z, curvature, lx, ly.
//
// With q = p - (0, 0, z) and s = c q.q - 2 q.n, a point's distance from it is s / (1 + sqrt(1 + c s)), which holds for
// c = 0 as well.
class SphereFit {
 public:
  SphereFit(std::vector<Vec3> points, double z) : points_(std::move(points)), unknowns_(z, 0, 0, 0), best_(unknowns_) {}

  void solve() {
    start();
    constexpr int kMaxSteps = 50;
    double before = std::numeric_limits<double>::infinity();
    for (int step = 0; step < kMaxSteps; ++step) {
      Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
      Eigen::Vector4d right = Eigen::Vector4d::Zero();
      double sum = 0;
      for (const Vec3& p : points_) {
        Eigen::Vector4d slope;
        const double d = distance(p, &slope);
        normal += slope * slope.transpose();
        right += slope * d;
        sum += d * d;
      }
      if (!(sum < before * (1 - 1e-12))) break;
      before = sum;
      best_ = unknowns_;
      unknowns_ -= normal.ldlt().solve(right);
    }
    unknowns_ = best_;
  }

  FittedFace face() const {
    FittedFace face;
    face.z_mm = unknowns_[0];
    face.curvature = unknowns_[1];
    face.tilt_deg[0] = kDegreesPerRadian * std::asin(unknowns_[2]);
    face.tilt_deg[1] = kDegreesPerRadian * std::asin(unknowns_[3]);
    face.corners = points_.size();
    double squares = 0;
    for (const Vec3& p : points_) {
      const double d = distance(p, nullptr);
      squares += d * d;
      face.residual_largest_mm = std::max(face.residual_largest_mm, std::fabs(d));
      face.clear_radius_mm = std::max(face.clear_radius_mm, std::hypot(p.x, p.y));
    }
    face.residual_rms_mm = std::sqrt(squares / static_cast<double>(points_.size()));
    return face;
  }

 private:
  // Start value: the linear equation c q.q - 2 q.n + e = 0 with a normal of z component 1.
  void start() {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Vec3& p : points_) {
      const Vec3 q = p - Vec3{0, 0, unknowns_[0]};
      const Eigen::Vector4d row(dot(q, q), -2 * q.x, -2 * q.y, 1);
      normal += row * row.transpose();
      right += row * (2 * q.z);
    }
    const Eigen::Vector4d found = normal.ldlt().solve(right);
    const double scale = 1 / std::sqrt(1 + found[1] * found[1] + found[2] * found[2]);
    unknowns_ << unknowns_[0] + found[3] / 2, scale * found[0], scale * found[1], scale * found[2];
  }

  double distance(const Vec3& p, Eigen::Vector4d* slope) const {
    const double c = unknowns_[1];
    const Vec3 q = p - Vec3{0, 0, unknowns_[0]};
    const double lx = unknowns_[2], ly = unknowns_[3], lz = std::sqrt(std::max(1e-6, 1 - lx * lx - ly * ly));
    const double s = c * dot(q, q) - 2 * (q.x * lx + q.y * ly + q.z * lz);
    const double root = std::sqrt(std::max(1e-12, 1 + c * s));
    const double d = s / (1 + root);
    if (slope) {
      // d(distance)/ds = 1 / (2 root), at fixed c; besides, c enters the root.
      const double by_s = 1 / (2 * root);
      const double by_c = -s * s / (2 * root * (1 + root) * (1 + root));
      (*slope)[0] = by_s * (-2 * c * q.z + 2 * lz);
      (*slope)[1] = by_s * dot(q, q) + by_c;
      (*slope)[2] = by_s * (-2 * q.x + 2 * q.z * lx / lz);
      (*slope)[3] = by_s * (-2 * q.y + 2 * q.z * ly / lz);
    }
    return d;
  }

  std::vector<Vec3> points_;
  Eigen::Vector4d unknowns_, best_;
};

FittedFace fit_patch(const Mesh& mesh, const Patches& patches, std::size_t triangle, double z, const char* side,
                     const std::string& file) {
  std::vector<char> used(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (patches.of_triangle[t] == patches.of_triangle[triangle])
      for (const std::uint32_t corner : mesh.triangles[t]) used[corner] = 1;
  std::vector<Vec3> points;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) points.push_back(mesh.vertices[v]);
  if (points.size() < kMinFittedCorners)
    throw Error(ErrorKind::bad_input, file + ": the smooth surface on the axis " + side + ", at face " +
                                          std::to_string(mesh.face_number(triangle)) + ", has " +
                                          std::to_string(points.size()) + " corners; a sphere needs " +
                                          std::to_string(kMinFittedCorners) +
                                          "; use a finer mesh: faces at more than 20 degrees to each other count as "
                                          "separated by an edge");
  SphereFit fit(std::move(points), z);
  fit.solve();
  return fit.face();
}

}  // namespace

FittedElement fit_element(const Mesh& mesh, const std::string& file) {
  std::size_t first = mesh.triangles.size(), last = first;
  double first_z = std::numeric_limits<double>::infinity(), last_z = -first_z;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const std::optional<double> z = height_on_axis(mesh, t)) {
      if (*z < first_z) first = t, first_z = *z;
      if (*z > last_z) last = t, last_z = *z;
    }
  const Patches patches = smooth_patches(mesh);
  if (first == mesh.triangles.size())
    throw Error(ErrorKind::bad_input,
                file + ": the z axis (x = y = 0) misses the mesh; lens meshes must be around it, in lens coordinates");
  if (patches.of_triangle[first] == patches.of_triangle[last])
    throw Error(ErrorKind::bad_input,
                file + ": the axis enters and leaves the mesh through the same smooth surface, from face " +
                    std::to_string(mesh.face_number(first)) + " to face " + std::to_string(mesh.face_number(last)) +
                    ": expected two faces with an edge between them");
  return {fit_patch(mesh, patches, first, first_z, "in front", file),
          fit_patch(mesh, patches, last, last_z, "at the back", file)};
}

}  // namespace relign::meshes
