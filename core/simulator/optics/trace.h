// Sequential tracing of single rays in double, from the object to the image: golden rays, chief rays, spot diagrams.
// For images use ray_block.h.
#pragma once

#include <string>
#include <vector>

#include "optics/assembly.h"

namespace relign::optics {

struct Ray {
  Vec3 start;      // mm, lens coordinates
  Vec3 direction;  // any length; light travels +z, behind an odd number of mirrors -z
};

struct TracedRay {
  bool passed = false;
  std::string lost_at;       // "L3 front: outside the clear aperture", empty if it passed
  std::vector<Vec3> hits;    // on each face, in order, lens coordinates
  Vec3 image;                // on the image plane; valid if passed
  Vec3 exit_direction;       // unit; valid if passed
  double transmittance = 1;  // of the faces, uncoated glass, unpolarised; mirrors lose nothing; valid if passed
  // From the start to `image`: lengths times indices relative to the ambient medium, negative where the ray is traced
  // backwards to a face or the image plane; valid if passed.
  double optical_path_mm = 0;
  double path_to_last_mm = 0;  // the same, to the last face
};

// Faces in their order, stops between them, then the image plane at the prescription's image_z_mm.
TracedRay trace(const Assembly& assembly, const Ray& ray, Apertures apertures);

// The ray of an object point at infinity at `field_deg` (in the y-z plane), aimed at the centre of the paraxial
// entrance pupil, the default of design programs.
Ray chief_ray(const Prescription& lens, double field_deg);

// Height of the chief ray on the image plane over the paraxial chief ray's in the same plane, minus 1.
// Throws Error(bad_input) when the chief ray is lost.
double distortion(const Prescription& lens, double field_deg);

}  // namespace relign::optics
