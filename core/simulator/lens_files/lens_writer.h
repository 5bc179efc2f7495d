// Converts a design to a lens file (lens.json): elements from surfaces, positions from thicknesses and coordinate
// breaks, glasses. Values that need ray tracing (missing semi-diameters, a missing stop opening) are left to
// completion.h.
#pragma once

#include <map>
#include <string>

#include "lens_files/glasses.h"
#include "lens_files/lens_design.h"

namespace relign::lens_files {

struct LensDraft {
  OrderedJson json;
  // Surface number in the design by pointer into the JSON ("/elements/0/faces/1", "/stops/0").
  std::map<std::string, std::size_t> surface_of;
  bool image_stated = true;  // false: the file has no distance to the image
};

// Adds remarks to the design. Throws Error(bad_input) with file and line of every mistake. `wavelength_nm` 0: the
// design's. polychromatic: the scene will have all wavelengths of the design (scene_layout.h), so that no remark about
// unused ones is needed.
LensDraft draft_lens(LensDesign& design, const GlassSources& sources, const std::string& name, double wavelength_nm,
                     bool polychromatic = false);

}  // namespace relign::lens_files
