// Converts a design to a draft of a lens file (lens.json): elements from surfaces, positions from thicknesses and
// coordinate breaks, glasses. Values that need ray tracing (missing semi-diameters, a missing stop opening) are left to
// completion.h.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lens_files/glasses.h"
#include "lens_files/lens_design.h"

namespace relign::lens_files {

// `surface` is the number in the design of the surface, which has the rest: conic, polynomials, line in the file.
struct DraftFace {
  std::size_t surface = 0;
  double z_mm = 0;
  std::optional<double> radius_mm;  // empty: a plane
  GlassBehind behind;
  std::optional<double> semi_diameter_mm;  // empty: not stated, or not yet found
};

struct DraftPlacement {
  double tilt_x_deg = 0, tilt_y_deg = 0, shift_x_mm = 0, shift_y_mm = 0;
};

struct DraftElement {
  std::string name;
  std::optional<DraftPlacement> placement;
  std::vector<DraftFace> faces;
};

struct DraftStop {
  std::size_t surface = 0;
  double z_mm = 0;
  std::optional<double> opening_radius_mm;  // empty: not yet found
  std::optional<std::size_t> before_face;   // counted from 0, where the position does not imply it
  bool on_face = false;                     // the stop is that face
};

struct LensDraft {
  std::string name;
  std::string source;
  double wavelength_nm = 0;
  double half_field_deg = 0;
  double image_z_mm = 0;
  bool image_stated = true;  // false: the file has no distance to the image
  std::optional<double> entrance_pupil_diameter_mm;
  OrderedJson glasses;
  std::vector<DraftElement> elements;
  DraftStop stop;
};

// Semi-diameter and opening written for those that are still missing: the smallest that a lens file may have.
inline constexpr double kProvisional_mm = 1e-6;

// Adds remarks to the design. Throws Error(bad_input) with file and line of every mistake. `wavelength_nm` 0: the
// design's. polychromatic: the scene will have all wavelengths of the design (scene_layout.h), so that no remark about
// unused ones is needed.
LensDraft draft_lens(LensDesign& design, const GlassSources& sources, const std::string& name, double wavelength_nm,
                     bool polychromatic = false);

OrderedJson lens_json(const LensDraft& draft, const LensDesign& design);

}  // namespace relign::lens_files
