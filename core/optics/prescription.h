// A lens as designed: elements with spherical, plane, conic or even aspheric faces, stops, the mount. Data,
// read from JSON with units in the names; lengths in mm, z along the axis from the object to the image,
// z = 0 at the first vertex.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "optics/rigid.h"

namespace relign::optics {

// Which clear radii block rays: those of the scene's meshes (images), those of the design program's
// listing (its own checks), or none (first-order and golden rays).
enum class Apertures { mesh, listing, none };

inline constexpr std::size_t kMostAsphereTerms = 9;  // r^4 to r^20

struct Face {
  double z_mm = 0;                   // vertex
  double curvature = 0;              // 1 / radius, 1/mm; positive: centre on the image side; 0: plane
  double conic = 0;                  // k: 0 sphere, -1 paraboloid
  std::vector<double> even_asphere;  // a4, a6, ...: the sag grows by a4 r^4 + a6 r^6 + ...; 1/mm^3, 1/mm^5, ...
  double index_after = 1;            // relative to the ambient medium; the ambient's own (1) behind the last face
  std::string glass;                 // its name where the file gives one, else empty
  double clear_radius_mm = 0;
  double listing_clear_radius_mm = 0;

  bool is_sphere() const { return conic == 0 && even_asphere.empty(); }  // or plane
  double clear_radius(Apertures apertures) const {
    return apertures == Apertures::listing ? listing_clear_radius_mm : clear_radius_mm;
  }
};

struct Element {
  std::string name;
  std::vector<Face> faces;  // front to back
  Motion placement = {};    // how the design itself places the element, off the axis or tilted
};

// A plane with an opening in the air. Rays pass it before every element of which the last vertex lies behind it: a stop
// close in front of a convex face may stand behind its vertex, with its rim still in the air around the bulge. Where
// the ray has met the glass before the stop's plane, the line that it came on is followed to the plane, as design
// programs do.
struct Stop {
  std::string name;
  double z_mm = 0;
  double opening_radius_mm = 0;
  bool in_listing = false;  // the design program's listing has it too
  bool aperture = false;    // the aperture stop: defines the pupils
};

bool stands_before(const Stop& stop, const Element& element);

// The black tube around the lens; everything that meets it is absorbed.
struct Mount {
  double bore_radius_mm = 0;
  double from_z_mm = 0;
  double to_z_mm = 0;
};

// Published values that `lens info` and the tests compare with; absent ones are NaN.
struct Published {
  std::string name;
  double value = 0;
};

struct Prescription {
  std::string name;
  std::string source;
  double wavelength_nm = 0;
  double image_z_mm = 0;
  double pivot_z_mm = 0;  // on the axis: elements tilt about this point
  double half_field_deg = 0;
  // The design's specification; 0: as wide as the aperture stop's opening makes it. (Design programs
  // open the stop for real rays, a little wider than first order would.)
  double entrance_pupil_diameter_mm = 0;
  std::vector<Element> elements;
  std::vector<Stop> stops;
  std::optional<Mount> mount;
  std::vector<Published> published;

  const Stop& aperture_stop() const;
  const Element* element(const std::string& name) const;  // null when there is none
};

// Reads and checks a lens file. Throws Error(bad_input) that lists every mistake with its place:
// indices under 1, unknown glasses (never replaced), faces that cross or are out of order, clear radii larger
// than a face's shape allows, stops inside glass, no aperture stop, names that stand twice.
Prescription read_prescription(const std::filesystem::path& file);
Prescription read_prescription(const JsonSource& source);

}  // namespace relign::optics
