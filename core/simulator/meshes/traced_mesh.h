// One mesh as rays see it: Embree finds the triangle, the rest is reckoned in double.
#pragma once

#include "meshes/mesh.h"
#include "meshes/smooth.h"

// Embree's own types; its header stays in traced_mesh.cpp.
struct RTCDeviceTy;
struct RTCSceneTy;

namespace relign::meshes {

// One thread builds the trees: they, and so the images, do not depend on the machine's load.
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
  bool entering = false;  // the ray goes against the outward side of the facet
  Vec3 at, normal;        // on the facet; unit, outwards, of the smooth surface. Unset for what is not smooth
};

class TracedMesh {
 public:
  // `device` outlives the mesh. smooth: points have normals; for meshes that are closed.
  TracedMesh(const EmbreeDevice& device, const Mesh& mesh, bool smooth);
  ~TracedMesh();
  TracedMesh(TracedMesh&& other) noexcept;
  TracedMesh& operator=(TracedMesh&& other) = delete;

  // Where the line enters the box around the mesh, perhaps behind its start; infinity where it passes beside.
  double box_entry(const Vec3& start, const Vec3& direction) const;
  // The nearest point at a distance between `from` and `to` along a unit vector; false without one.
  bool nearest(const Vec3& start, const Vec3& direction, double from, double to, SurfacePoint& point) const;

 private:
  bool nearest_triangle(const Vec3& start, const Vec3& direction, double from, double to,
                        std::uint32_t& triangle) const;

  Mesh mesh_;
  CornerNormals normals_;
  Vec3 low_, high_, middle_;  // of the box around it; Embree's copy lies around the middle, where floats are finer
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace relign::meshes
