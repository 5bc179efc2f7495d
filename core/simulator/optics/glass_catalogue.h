// Glasses of the vendors' published catalogues, built in besides those of glass.h.
//
// Where two vendors have a glass of one name, the earlier vendor keeps it (Schott, Ohara, Hoya, Hikari, CDGM, Sumita);
// the other's is NAME_VENDOR. The tables in glass_catalogue/ are written by tests/peers/make_glass_catalogue.py.
#pragma once

#include <string>
#include <vector>

#include "optics/glass.h"

namespace relign::optics {

struct PublishedGlass {
  std::string vendor;  // "SCHOTT"; "SPECIAL" for materials of no vendor
  Glass glass;
};

// In the order of the vendors; names are unique.
const std::vector<PublishedGlass>& published_glasses();

// In upper case; false for other words than the vendors of published_glasses().
bool is_glass_vendor(const std::string& name);

}  // namespace relign::optics
