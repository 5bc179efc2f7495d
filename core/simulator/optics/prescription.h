// A lens as designed: elements with spherical, plane, conic or aspheric faces, stops, the barrel. Plain data, read from
// JSON with units in the names; lengths in mm, z along the axis from the object to the image, z = 0 at the first
// vertex.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "optics/rigid.h"

namespace relign::optics {

// Which semi-diameters block rays: those of the scene's meshes (images), those of the design program's listing
// (comparisons with it), or none (first-order and golden rays).
enum class Apertures { mesh, listing, none };

inline constexpr std::size_t kMaxEvenTerms = 15;  // r^4 to r^32
inline constexpr std::size_t kMaxOddTerms = 8;    // r^3 to r^17
inline constexpr std::size_t kMaxQTerms = 14;     // of Forbes's sums, so that no power exceeds r^32

struct Face {
  double z_mm = 0;       // vertex
  double curvature = 0;  // 1 / radius, 1/mm; positive: centre on the image side; 0: plane
  double conic = 0;      // k: 0 sphere, -1 paraboloid
  // Terms of the sag besides the conic (face_shape.h). Forbes's "q_con" is converted to `even_asphere`, his "q_bfs" to
  // `over_root`: the same polynomials in powers of r.
  double r2_term = 0;                // a2, 1/mm
  std::vector<double> even_asphere;  // a4, a6, ...; 1/mm^3, 1/mm^5, ...
  std::vector<double> odd_asphere;   // a3, a5, ...; 1/mm^2, 1/mm^4, ...
  std::vector<double> over_root;     // b2, b4, ...; 1/mm, 1/mm^3, ...
  bool mirror = false;
  // Relative to the ambient medium, so 1 behind the last face. Negative where light travels towards -z, behind an odd
  // number of mirrors.
  double index_after = 1;
  std::string glass;  // its name where the file gives one, else empty
  double clear_radius_mm = 0;
  double listing_clear_radius_mm = 0;

  bool is_conic() const {  // or sphere or plane: no polynomial
    return r2_term == 0 && even_asphere.empty() && odd_asphere.empty() && over_root.empty();
  }
  bool is_sphere() const { return conic == 0 && is_conic(); }  // or plane
  // Curvature at the vertex, for first-order optics.
  double vertex_curvature() const { return curvature + 2 * (r2_term + (over_root.empty() ? 0 : over_root.front())); }
  double clear_radius(Apertures apertures) const {
    return apertures == Apertures::listing ? listing_clear_radius_mm : clear_radius_mm;
  }
};

struct Element {
  std::string name;
  std::vector<Face> faces;  // in the order of the light; a mirror in air is an element of one face
  Motion placement = {};    // off the axis or tilted in the design itself
};

// A plane with an opening, or the clear edge of a face. Rays pass it in surface order, as in design programs: the
// incoming ray is extended to the stop's plane, even if the plane cuts a face or is inside the glass behind it.
struct Stop {
  std::string name;
  double z_mm = 0;
  double opening_radius_mm = 0;
  bool in_listing = false;  // also in the design program's listing
  bool aperture = false;    // the aperture stop: defines the pupils
  // The stop comes before this face, counted over all elements from the front, from 0 (the number of faces: behind the
  // last). Without a value: before the first element whose last vertex is behind the stop.
  std::optional<std::size_t> before_face = std::nullopt;
  // The stop is the edge of the face `before_face` itself, which may be curved: z_mm is its vertex.
  bool on_face = false;
};

// The barrel, a black tube around the lens ("mount" in lens files): absorbs all light that hits it.
struct Barrel {
  double bore_radius_mm = 0;
  double from_z_mm = 0;
  double to_z_mm = 0;
};

// A published value that `lens info` and the tests compare with.
struct Published {
  std::string name;
  double value = 0;
};

struct Prescription {
  std::string name;
  std::string source;
  double wavelength_nm = 0;
  double image_z_mm = 0;
  double pivot_z_mm = 0;  // on the axis: pivot of element tilts
  double half_field_deg = 0;
  // As specified by the design; 0: follows from the opening of the aperture stop. (Design programs open the stop for
  // real rays, slightly wider than first order.)
  double entrance_pupil_diameter_mm = 0;
  std::vector<Element> elements;
  std::vector<Stop> stops;
  std::optional<Barrel> barrel;
  std::vector<Published> published;

  const Stop& aperture_stop() const;
  std::size_t face_count() const;
  // `lens info` and `lens draw` support mirrors; images, ghosts and meshes need refracting faces.
  bool has_mirrors() const;
  std::size_t faces_before(const Stop& stop) const;       // number of faces in front of the stop
  const Element* element(const std::string& name) const;  // null when there is none
};

// Reads and checks a lens file. Throws Error(bad_input) that lists every mistake with its position: indices below 1,
// unknown glasses (never replaced), faces that cross or are out of order, semi-diameters larger than a face's shape
// allows, stops inside glass, no aperture stop, duplicate names.
Prescription read_prescription(const std::filesystem::path& file);
Prescription read_prescription(const JsonSource& source);
// The same lens at another wavelength than the file's: same geometry, with the glasses' indices at that wavelength.
// Also rejects faces with a plain "index_after".
Prescription read_prescription_at(const JsonSource& source, double wavelength_nm);

}  // namespace relign::optics
