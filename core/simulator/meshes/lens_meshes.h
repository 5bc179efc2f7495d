// A lens made of meshes: glass that refracts, stops and mount that absorb. Embree finds the faces.
//
// Nothing is assumed about the order of faces: the nearest surface counts, edges refract too, and glass ends where a
// face looks along the ray. Normals are those of smooth surfaces (smooth.h). No reflections: light that would be
// totally reflected is lost. Elements are rigid bodies: rays are brought into their coordinates, so that an assembly
// or a pose costs nothing to set up.
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
  // `meshes` by name: every element of the lens; stops and "mount" (optional, they absorb; those without a mesh are the
  // prescription's planes and bore). Checked ones (mesh_check.h), in lens coordinates. Indices are the prescription's.
  // Throws Error(bad_input) for a missing element, a name that the lens does not have, an element with more than two
  // faces.
  LensMeshes(const optics::Prescription& lens, const std::map<std::string, Mesh>& meshes);
  ~LensMeshes() override;

  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
             const optics::BackwardPath& path) override;
  void trace(optics::RayBlock& block, bool fresnel, int count) const override;

  // One ray in lens coordinates, through the lens as placed, in whichever direction; `direction` is a unit vector.
  struct Passed {
    bool passed = false;  // false: absorbed, or lost in total reflection
    Vec3 at, direction;   // after the last face
    double transmittance = 1;
    int faces = 0;  // met
  };
  Passed trace_ray(const Vec3& start, const Vec3& direction, bool fresnel) const;

 private:
  struct Body;
  struct Hit;
  bool nearest_hit(const Vec3& at, const Vec3& direction, bool from_start, Hit& hit) const;
  bool absorbed_before(const Vec3& at, const Vec3& direction, double reach) const;

  std::unique_ptr<EmbreeDevice> device_;
  std::vector<Body> bodies_;
  // What the prescription says of stops and mount without a mesh.
  std::vector<optics::Stop> stops_;
  bool has_bore_ = false;
  optics::Mount mount_;
  optics::Motion first_frame_to_lens_, lens_to_world_;
};

}  // namespace relign::meshes
