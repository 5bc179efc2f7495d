// Ray tracing of one mesh: Embree finds the triangle, the hit is computed in double.
#pragma once

#include "meshes/mesh.h"
#include "meshes/smooth.h"

// Embree's types; its header is included only by traced_mesh.cpp.
struct RTCDeviceTy;
struct RTCSceneTy;

namespace relign::meshes {

// Builds trees with one thread, so that they, and the images, do not depend on the load of the machine.
class EmbreeDevice {
 public:
  EmbreeDevice();
  ~EmbreeDevice();
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;
  RTCDeviceTy* handle() const { return handle_; }

 private:
  RTCDeviceTy* handle_;
};

struct SurfacePoint {
  double distance = 0;    // along the ray, mm
  bool entering = false;  // the ray enters the body
  Vec3 at, normal;        // hit on the facet; unit outward normal of the smooth surface, unset if not smooth
};

class TracedMesh {
 public:
  // `device` must outlive the mesh. smooth: compute normals; for closed meshes.
  TracedMesh(const EmbreeDevice& device, const Mesh& mesh, bool smooth);
  ~TracedMesh();
  TracedMesh(TracedMesh&& other) noexcept;
  TracedMesh& operator=(TracedMesh&& other) = delete;

  // Distance at which the line enters the box around the mesh, negative behind the start; infinity on a miss.
  double box_entry(const Vec3& start, const Vec3& direction) const;
  // The nearest hit at a distance between `from` and `to` along a unit vector; false without one.
  bool nearest(const Vec3& start, const Vec3& direction, double from, double to, SurfacePoint& point) const;

 private:
  bool nearest_triangle(const Vec3& start, const Vec3& direction, double from, double to,
                        std::uint32_t& triangle) const;

  Mesh mesh_;
  CornerNormals normals_;
  Vec3 low_, high_,
      middle_;  // of the bounding box; Embree's copy is centred on the middle, where floats are more precise
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace relign::meshes
