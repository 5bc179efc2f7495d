// The paper's lens, as the tests use it.
#pragma once

#include <string>

#include "optics/prescription.h"

namespace relign::optics {

inline const Prescription& relign_od() {
  static const Prescription lens =
      read_prescription(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json");
  return lens;
}

}  // namespace relign::optics
