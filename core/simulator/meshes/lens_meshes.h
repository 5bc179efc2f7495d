// A lens made of meshes: glass refracts, stops and barrel absorb. Traced with Embree.
//
// Non-sequential: the nearest surface is hit, edges refract too, and a ray leaves glass where a face is oriented along
// it. Normals are those of smooth surfaces (smooth.h). No reflections: totally reflected light is lost. Elements are
// rigid bodies: rays are transformed to their coordinates, so that setting an assembly or a pose is cheap.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "meshes/mesh.h"
#include "optics/block_tracer.h"
#include "optics/prescription.h"

namespace relign::meshes {

class EmbreeDevice;

class LensMeshes final : public optics::BlockTracer {
 public:
  // `meshes` by name: every element of the lens; optionally stops and "mount" (the barrel), which absorb (without a
  // mesh they are the prescription's planes and bore). Meshes must be checked (mesh_check.h) and in lens coordinates.
  // Refractive indices are the prescription's. Throws Error(bad_input) for a missing element, an unknown name, an
  // element with more than two faces.
  LensMeshes(const optics::Prescription& lens, const std::map<std::string, Mesh>& meshes);
  ~LensMeshes() override;

  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
             const optics::BackwardPath& path) override;
  void trace(optics::RayBlock& block, bool fresnel, int count) const override;

  // Traces one ray in lens coordinates, in either direction, through the lens as placed; `direction` is a unit vector.
  struct Passed {
    bool passed = false;  // false: absorbed, or lost in total reflection
    Vec3 at, direction;   // after the last face
    double transmittance = 1;
    int faces = 0;  // number of faces hit
  };
  Passed trace_ray(const Vec3& start, const Vec3& direction, bool fresnel) const;

 private:
  struct Body;
  struct Hit;
  bool nearest_hit(const Vec3& at, const Vec3& direction, bool from_start, Hit& hit) const;
  bool absorbed_before(const Vec3& at, const Vec3& direction, double reach) const;

  std::unique_ptr<EmbreeDevice> device_;
  std::vector<Body> bodies_;
  // Stops and barrel of the prescription that have no mesh.
  std::vector<optics::Stop> stops_;
  bool has_bore_ = false;
  optics::Barrel barrel_;
  optics::Motion first_frame_to_lens_, lens_to_world_;
};

}  // namespace relign::meshes
