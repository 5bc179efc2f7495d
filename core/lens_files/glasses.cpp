#include "lens_files/glasses.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

// CODE V writes N-BK7 as NBK7: spellings of one name, the file's own first.
std::vector<std::string> spellings(const std::string& name) {
  std::vector<std::string> names = {name};
  static const std::vector<std::string> kPrefixes = {"N", "P", "S", "J", "L", "H", "E", "K", "D"};
  for (const std::string& prefix : kPrefixes)
    if (name.size() > 2 && name.compare(0, 1, prefix) == 0 && name[1] != '-')
      names.push_back(prefix + "-" + name.substr(1));
  return names;
}

}  // namespace

GlassChoice::GlassChoice(LensDesign& design, const GlassSources& sources, double wavelength_nm)
    : design_(design), sources_(sources), wavelength_nm_(wavelength_nm) {}

bool GlassChoice::from_catalogue(const Surface& surface, const std::string& name) {
  for (const GlassCatalogue& catalogue : sources_.catalogues)
    for (const CatalogueGlass& glass : catalogue.glasses) {
      if (upper_case(glass.name) != upper_case(name)) continue;
      const double um = wavelength_nm_ / 1000;
      if (glass.high_um > 0 && (um < glass.low_um || um > glass.high_um))
        design_.remarks.push_back({surface.glass_line,
                                   "glass " + name + ": " + catalogue.file + " gives its dispersion from " +
                                       shortest(glass.low_um) + " to " + shortest(glass.high_um) + " um, used at " +
                                       shortest(um) + " um",
                                   0});
      std::vector<double> coefficients = glass.coefficients;
      while (coefficients.size() > 1 && coefficients.back() == 0)  // zeros behind say nothing
        coefficients.pop_back();
      own_[name] = {{"agf_formula", glass.formula}, {"coefficients", coefficients}};
      return true;
    }
  return false;
}

void GlassChoice::write(const Surface& surface, OrderedJson& face) {
  const bool same_wavelength = std::fabs(wavelength_nm_ - design_.wavelength_nm) < 0.05;
  const double told = surface.index > 0 && same_wavelength ? surface.index
                      : surface.nd > 0 && surface.vd == 0  ? surface.nd
                                                           : 0;
  if (told > 0 && told < 1) {
    problems_.push_back({design_.file, surface.glass_line, 0, "",
                         "surface " + surface.label + ": an index of " + shortest(told) + "; glasses have 1 or more"});
    return;
  }
  if (told > 0) {
    face["index_after"] = told;
    return;
  }
  if (surface.nd > 0) {  // a model glass has no name; its numbers make one
    const std::string name = "nd" + shortest(surface.nd) + "-Vd" + shortest(surface.vd);
    own_[name] = {{"nd", surface.nd}, {"vd", surface.vd}};
    face["glass_after"] = name;
    return;
  }
  for (const std::string& name : spellings(surface.glass))
    if (from_catalogue(surface, name) || (sources_.is_known && sources_.is_known(name))) {
      face["glass_after"] = name;
      if (name != surface.glass)
        design_.remarks.push_back({surface.glass_line, "glass " + surface.glass + " is read as " + name, 0});
      return;
    }
  problems_.push_back({design_.file, surface.glass_line, 0, "",
                       "surface " + surface.label + ": unknown glass '" + shown(surface.glass, 40) +
                           "'; give the catalogue that has it with --glass FILE.agf, or write its code of nd and Vd, "
                           "such as 517642, into the lens file"});
}

}  // namespace relign::lens_files
