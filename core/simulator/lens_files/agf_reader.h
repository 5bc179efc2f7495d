// Zemax glass catalogues (.agf): name, dispersion formula and coefficients.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relign::lens_files {

struct CatalogueGlass {
  std::string name;
  int line = 0;
  int formula = 0;
  std::vector<double> coefficients;
  double nd = 0, vd = 0;
  double low_um = 0, high_um = 0;  // wavelength range of the formula; 0: not stated
};

// Throws Error(bad_input) with file and line of every mistake.
std::vector<CatalogueGlass> read_agf(std::string_view bytes, const std::string& file);

}  // namespace relign::lens_files
