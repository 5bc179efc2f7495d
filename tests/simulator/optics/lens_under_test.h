// The paper's lens for tests, and a variant with conics and aspheres.
#pragma once

#include <string>

#include "optics/prescription.h"

namespace relign::optics {

inline const Prescription& relign_od() {
  static const Prescription lens =
      read_prescription(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json");
  return lens;
}

// A conic, an asphere on a sphere, one on a conic, and a plane with a polynomial.
inline const Prescription& aspheric_relign_od() {
  static const Prescription lens = [] {
    Prescription changed = relign_od();
    changed.elements[0].faces[1].conic = -0.6;
    changed.elements[1].faces[1].even_asphere = {3e-4, -2e-5, 1e-6};
    changed.elements[2].faces[0].conic = 0.4;
    changed.elements[2].faces[0].even_asphere = {-2e-4, 1e-5, -3e-7, 2e-8, -1e-9, 3e-11, 1e-12, -1e-13, 2e-15};
    changed.elements[2].faces[1].curvature = 0;
    changed.elements[2].faces[1].even_asphere = {1e-3};
    changed.elements[3].faces[1].conic = -1;
    return changed;
  }();
  return lens;
}

}  // namespace relign::optics
