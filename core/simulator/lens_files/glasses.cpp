#include "lens_files/glasses.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

// Spellings of a name in the user's catalogues: unchanged, without the vendor that CODE V appends after "_", and with
// the hyphen that CODE V omits (NBK7).
std::vector<std::string> spellings(const std::string& name) {
  std::vector<std::string> names = {name};
  if (const std::size_t vendor = name.rfind('_'); vendor != std::string::npos && vendor > 0)
    names.push_back(name.substr(0, vendor));
  static const std::vector<std::string> kPrefixes = {"N", "P", "S", "J", "L", "H", "E", "K", "D"};
  const std::string stem = names.back();
  for (const std::string& prefix : kPrefixes)
    if (stem.size() > 2 && upper_case(stem.substr(0, 1)) == prefix && stem[1] != '-')
      names.push_back(prefix + "-" + upper_case(stem.substr(1)));
  return names;
}

}  // namespace

GlassAlias parse_alias(const std::string& text) {
  const std::size_t equals = text.find('=');
  GlassAlias alias;
  if (equals != std::string::npos) {
    alias.from = trimmed(text.substr(0, equals));
    alias.to = trimmed(text.substr(equals + 1));
  }
  if (alias.from.empty() || alias.to.empty())
    throw Error(ErrorKind::bad_input, "--alias: expected NAME=NAME, such as BK7=N-BK7, found '" + text + "'");
  return alias;
}

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
                                       shortest(glass.low_um) + " to " + shortest(glass.high_um) +
                                       " um, but the lens uses it at " + shortest(um) + " um",
                                   0});
      std::vector<double> coefficients = glass.coefficients;
      while (coefficients.size() > 1 && coefficients.back() == 0)  // trailing zeros have no effect
        coefficients.pop_back();
      own_[name] = {{"agf_formula", glass.formula}, {"coefficients", coefficients}};
      return true;
    }
  return false;
}

GlassBehind GlassChoice::of(const Surface& surface) {
  const bool same_wavelength = std::fabs(wavelength_nm_ - design_.wavelength_nm) < 0.05;
  const double index = surface.index > 0 && same_wavelength ? surface.index
                       : surface.nd > 0 && surface.vd == 0  ? surface.nd
                                                            : 0;
  if (index > 0 && index < 1) {
    problems_.push_back({design_.file, surface.glass_line, 0, "",
                         "surface " + surface.label + ": expected an index of 1 or more, found " + shortest(index)});
    return {};
  }
  if (index > 0) return {index, ""};
  if (surface.nd > 0) {  // a model glass has no name: make one of its numbers
    const std::string name = "nd" + shortest(surface.nd) + "-Vd" + shortest(surface.vd);
    own_[name] = {{"nd", surface.nd}, {"vd", surface.vd}};
    return {0, name};
  }
  if (const std::string name = resolved(surface); !name.empty()) return {0, name};
  const std::string shown_name = shown(surface.glass, 40);
  if (sources_.from_file && surface.stated_nd > 0) {
    own_[surface.glass] = {{"nd", surface.stated_nd}, {"vd", surface.stated_vd}};
    remark(surface, "glass " + shown_name + " has the index and Abbe number that the file states, nd " +
                        shortest(surface.stated_nd) + " and Vd " + shortest(surface.stated_vd) +
                        " (--glass-from-file)");
    return {0, surface.glass};
  }
  problems_.push_back(
      {design_.file, surface.glass_line, 0, "",
       "surface " + surface.label + ": unknown glass '" + shown_name +
           "'; give its catalogue with --glass FILE.agf, name an equivalent glass with --alias " + shown_name +
           "=NAME, or " +
           (surface.stated_nd > 0 ? "use nd " + shortest(surface.stated_nd) + " and Vd " + shortest(surface.stated_vd) +
                                        " from the file with --glass-from-file"
                                  : "replace it by a code of nd and Vd, such as 517642, in the lens file")});
  return {};
}

void GlassChoice::remark(const Surface& surface, const std::string& text) {
  for (const Remark& known : design_.remarks)
    if (known.text == text) return;
  design_.remarks.push_back({surface.glass_line, text, 0});
}

std::string GlassChoice::resolved(const Surface& surface) {
  std::string wanted = surface.glass;
  for (const GlassAlias& alias : sources_.aliases)
    if (upper_case(alias.from) == upper_case(surface.glass)) wanted = alias.to;
  std::string found;
  for (const std::string& name : spellings(wanted))
    if (found.empty() && from_catalogue(surface, name)) found = name;
  if (found.empty() && sources_.is_known && sources_.is_known(wanted)) found = wanted;
  if (found.empty() && sources_.known_like) found = sources_.known_like(wanted);
  if (found.empty())
    for (const std::string& name : spellings(wanted))
      if (found.empty() && !sources_.known_like && sources_.is_known && sources_.is_known(name)) found = name;
  const std::string plain = surface.glass.substr(0, surface.glass.rfind('_'));
  if (!found.empty() && found != surface.glass && found != plain)
    remark(surface, "glass " + shown(surface.glass, 40) + " is read as " + found +
                        (wanted == surface.glass ? "" : " (--alias)"));
  return found;
}

}  // namespace relign::lens_files
