// From a design to a lens file of ours (lens.json): elements from surfaces, positions from thicknesses and coordinate
// breaks, glasses. What only rays can tell (missing clear radii, a missing stop opening) is left to completion.h.
#pragma once

#include <map>
#include <string>

#include "lens_files/glasses.h"
#include "lens_files/lens_design.h"

namespace relign::lens_files {

struct LensDraft {
  OrderedJson json;
  // Which surface of the design stands at a place of the JSON ("/elements/0/faces/1", "/stops/0").
  std::map<std::string, std::size_t> surface_of;
  bool image_told = true;  // false: no distance to the image in the file
};

// Adds remarks to the design. Throws Error(bad_input) with file and line of every mistake. `wavelength_nm` 0: the
// design's. polychromatic: the scene will have all wavelengths of the design (scene_layout.h), so that none is left
// out.
LensDraft draft_lens(LensDesign& design, const GlassSources& sources, const std::string& name, double wavelength_nm,
                     bool polychromatic = false);

}  // namespace relign::lens_files
