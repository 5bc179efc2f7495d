#include "meshes/traced_mesh.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "base/error.h"

namespace relign::meshes {
namespace {

// The interval of a line inside a box.
struct Interval {
  double near = 0, far = 0;
};

constexpr double kNowhere = std::numeric_limits<double>::infinity();

// Throws for an error code of Embree.
[[noreturn]] void embree_failed(RTCError code) {
  throw Error(ErrorKind::internal, "Embree failed with code " + std::to_string(static_cast<int>(code)) +
                                       (code == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory" : ""));
}

Interval clip(const Vec3& p, const Vec3& d, const Vec3& low, const Vec3& high) {
  Interval box{-kNowhere, kNowhere};
  const auto axis = [&](double at, double along, double least, double most) {
    if (along == 0) {
      if (at < least || at > most) box.near = kNowhere;
      return;
    }
    const double a = (least - at) / along, b = (most - at) / along;
    box.near = std::max(box.near, std::min(a, b));
    box.far = std::min(box.far, std::max(a, b));
  };
  axis(p.x, d.x, low.x, high.x);
  axis(p.y, d.y, low.y, high.y);
  axis(p.z, d.z, low.z, high.z);
  return box;
}

}  // namespace

EmbreeDevice::EmbreeDevice() : handle_(rtcNewDevice("threads=1,set_affinity=0")) {
  if (!handle_) embree_failed(rtcGetDeviceError(nullptr));
}

EmbreeDevice::~EmbreeDevice() { rtcReleaseDevice(handle_); }

TracedMesh::TracedMesh(const EmbreeDevice& device, const Mesh& mesh, bool smooth) : mesh_(mesh) {
  if (smooth) normals_ = corner_normals(mesh_);
  low_ = {kNowhere, kNowhere, kNowhere};
  high_ = {-kNowhere, -kNowhere, -kNowhere};
  for (const Vec3& v : mesh_.vertices) {
    low_ = {std::min(low_.x, v.x), std::min(low_.y, v.y), std::min(low_.z, v.z)};
    high_ = {std::max(high_.x, v.x), std::max(high_.y, v.y), std::max(high_.z, v.z)};
  }
  middle_ = 0.5 * (low_ + high_);
  constexpr double kWider = 1e-5;  // than the mesh, so that flat meshes have a box with volume
  low_ = low_ - Vec3{kWider, kWider, kWider};
  high_ = high_ + Vec3{kWider, kWider, kWider};

  RTCGeometry geometry = rtcNewGeometry(device.handle(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh_.vertices.size()));
  auto* const indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), mesh_.triangles.size()));
  if (!vertices || !indices) embree_failed(rtcGetDeviceError(device.handle()));
  for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
    const Vec3 p = mesh_.vertices[v] - middle_;
    vertices[3 * v] = static_cast<float>(p.x);
    vertices[3 * v + 1] = static_cast<float>(p.y);
    vertices[3 * v + 2] = static_cast<float>(p.z);
  }
  std::memcpy(indices, mesh_.triangles.data(), mesh_.triangles.size() * sizeof(Triangle));
  rtcCommitGeometry(geometry);
  scene_ = rtcNewScene(device.handle());
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);  // no ray passes between two adjacent triangles
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  // Reading the error clears it.
  if (const RTCError code = rtcGetDeviceError(device.handle()); code != RTC_ERROR_NONE) embree_failed(code);
}

TracedMesh::~TracedMesh() {
  if (scene_) rtcReleaseScene(scene_);
}

TracedMesh::TracedMesh(TracedMesh&& other) noexcept
    : mesh_(std::move(other.mesh_)),
      normals_(std::move(other.normals_)),
      low_(other.low_),
      high_(other.high_),
      middle_(other.middle_),
      scene_(std::exchange(other.scene_, nullptr)) {}

double TracedMesh::box_entry(const Vec3& start, const Vec3& direction) const {
  const Interval box = clip(start, direction, low_, high_);
  return box.near > box.far || box.far < 0 ? kNowhere : box.near;
}

bool TracedMesh::nearest_triangle(const Vec3& start, const Vec3& direction, double from, double to,
                                  std::uint32_t& triangle) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  const Vec3 from_middle = start - middle_;
  query.ray.org_x = static_cast<float>(from_middle.x);
  query.ray.org_y = static_cast<float>(from_middle.y);
  query.ray.org_z = static_cast<float>(from_middle.z);
  query.ray.dir_x = static_cast<float>(direction.x);
  query.ray.dir_y = static_cast<float>(direction.y);
  query.ray.dir_z = static_cast<float>(direction.z);
  query.ray.tnear = static_cast<float>(from);
  query.ray.tfar = static_cast<float>(to);
  query.ray.mask = 0xffffffffU;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &context, &query);
  triangle = query.hit.primID;
  return query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

bool TracedMesh::nearest(const Vec3& start, const Vec3& direction, double from, double to, SurfacePoint& point) const {
  std::uint32_t triangle = 0;
  if (!nearest_triangle(start, direction, from, to, triangle)) return false;
  const Vec3 &v0 = mesh_.corner(triangle, 0), edge1 = mesh_.corner(triangle, 1) - v0,
             edge2 = mesh_.corner(triangle, 2) - v0;
  const Vec3 facet = cross(edge1, edge2);
  const double along = dot(facet, direction);
  if (along == 0) return false;
  point.distance = dot(v0 - start, facet) / along;
  if (point.distance >= to) return false;
  point.entering = along < 0;
  point.at = start + point.distance * direction;
  if (normals_.corners.empty()) return true;
  const Vec3 q = point.at - v0;
  const double scale = 1 / dot(facet, facet);
  const double u = scale * dot(cross(q, edge2), facet), v = scale * dot(cross(edge1, q), facet);
  const Triangle& corners = normals_.corners[triangle];
  point.normal = unit((1 - u - v) * normals_.normals[corners[0]] + u * normals_.normals[corners[1]] +
                      v * normals_.normals[corners[2]]);
  // Near grazing incidence the smooth normal may face the other way than the facet.
  if ((dot(point.normal, direction) < 0) != point.entering) point.normal = unit(facet);
  return true;
}

}  // namespace relign::meshes
