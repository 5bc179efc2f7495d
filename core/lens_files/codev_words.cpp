#include "lens_files/codev_words.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

bool CodeVSystem::take(int line, const std::vector<std::string>& words) {
  static const std::set<std::string> kWithoutMeaning = {"WTW", "WTF", "INI", "POL", "RDM", "TEM", "PRE", "PIM",
                                                        "WTA", "CRA", "PTP", "POR", "PFR", "PUX", "PUY", "PUI"};
  static const std::set<std::string> kVignetting = {"VUX", "VLX", "VUY", "VLY"};
  static const std::set<std::string> kFields = {"XAN", "YAN", "XOB", "YOB", "XIM", "YIM", "XRI", "YRI"};
  constexpr double kShortest_nm = 100, kLongest_nm = 1e5;
  const std::string keyword = upper_case(words[0]);
  const std::string value = words.size() > 1 ? words[1] : "";
  const auto aperture = [&](SystemAperture::Kind kind) {
    reading_.aperture(line, keyword, kind, value);
    return true;
  };
  if (kWithoutMeaning.count(keyword) > 0) return true;
  if (kFields.count(keyword) > 0) return take_fields(line, keyword, words);
  if (keyword == "EPD") return aperture(SystemAperture::entrance_pupil_diameter);
  if (keyword == "FNO") return aperture(SystemAperture::f_number);
  if (keyword == "NAO") return aperture(SystemAperture::object_na);
  if (keyword == "NA") return aperture(SystemAperture::image_na);
  if (keyword == "DIM") {
    const std::string unit = upper_case(value);
    // M, C and I in sequence files; a listing writes them out.
    const auto factor = millimetres(unit == "M" ? "MM" : unit == "C" ? "CM" : unit == "I" ? "IN" : unit);
    if (!factor) reading_.problem(line, "DIM: '" + shown(value, 20) + "' is none of M, C, I (mm, cm, inches)");
    unit_mm_ = factor.value_or(1);
    unit_told_ = true;
  } else if (keyword == "WL") {
    wavelengths_nm_.clear();
    for (std::size_t i = 1; i < words.size(); ++i)
      wavelengths_nm_.push_back(reading_.number(line, words[i], "WL, nanometres", 1e6));
    for (const double wavelength : wavelengths_nm_)
      if (!(wavelength >= kShortest_nm && wavelength <= kLongest_nm))
        reading_.problem(line, "WL: a wavelength of " + shortest(wavelength) +
                                   " nm; WL is in nanometres, 100 to 100000 (green: 550)");
    reading_.design.wavelengths_line = line;
  } else if (keyword == "REF") {
    reference_ = reading_.integer(line, value, "REF");
    reference_line_ = line;
  } else if (kVignetting.count(keyword) > 0) {
    for (std::size_t i = 1; i < words.size(); ++i)
      if (parse_number(words[i]).value_or(1) != 0) {
        reading_.remark(line, "vignetting", "not used: vignetting factors; clear radii stop the light here");
        break;
      }
  } else {
    return false;
  }
  return true;
}

bool CodeVSystem::take_fields(int line, const std::string& keyword, const std::vector<std::string>& words) {
  std::vector<double>& fields = keyword[0] == 'X' ? x_fields_ : y_fields_;
  fields.clear();
  for (std::size_t i = 1; i < words.size(); ++i) fields.push_back(reading_.number(line, words[i], keyword));
  FieldSize& field = reading_.design.field;
  field.line = line;
  field.kind = keyword.compare(1, 2, "AN") == 0   ? FieldSize::angle_deg
               : keyword.compare(1, 2, "OB") == 0 ? FieldSize::object_height_mm
                                                  : FieldSize::image_height_mm;
  return true;
}

double CodeVSystem::reference_wavelength_nm() const {
  const bool known = reference_ >= 1 && static_cast<std::size_t>(reference_) <= wavelengths_nm_.size();
  return known ? wavelengths_nm_[static_cast<std::size_t>(reference_) - 1] : 0;
}

LensDesign CodeVSystem::finish() {
  LensDesign& design = reading_.design;
  FieldSize& field = design.field;
  for (std::size_t i = 0; i < std::max(x_fields_.size(), y_fields_.size()); ++i)
    field.value = std::max(
        field.value, std::hypot(i < x_fields_.size() ? x_fields_[i] : 0, i < y_fields_.size() ? y_fields_[i] : 0));
  if (field.value == 0) field.kind = FieldSize::none;
  if (wavelengths_nm_.empty()) {
    reading_.problem(0, "no wavelength (WL) found");
  } else if (reference_wavelength_nm() == 0) {
    reading_.problem(reference_line_, "REF: the reference wavelength is number " + std::to_string(reference_) +
                                          ", but there are " + std::to_string(wavelengths_nm_.size()));
  }
  design.wavelength_nm = reference_wavelength_nm();
  design.all_wavelengths_nm = wavelengths_nm_;
  if (!unit_told_) reading_.remark(0, "unit", "assumed: lengths in mm; the file has no DIM");
  LensDesign result = reading_.finish();
  scale(result, unit_mm_);
  return result;
}

void take_glass(Reading& reading, Surface& surface, int line, const std::string& word) {
  const std::string name = upper_case(word);
  if (name == "AIR" || name == "REFR" || name.empty()) return;
  if (name == "REFL") {
    reading.problem(line, "surface " + surface.label + " is a mirror (REFL); only lenses are read");
    return;
  }
  surface.glass_line = line;
  const std::size_t catalogue = word.rfind('_');
  surface.glass = catalogue == std::string::npos || catalogue == 0 ? word : word.substr(0, catalogue);
}

Surface* surface_of(Reading& reading, const std::string& qualifier) {
  std::vector<Surface>& surfaces = reading.design.surfaces;
  const std::string name = upper_case(qualifier);
  if (surfaces.empty() || name.size() < 2 || name.size() > 6 || name[0] != 'S') return nullptr;
  if (name == "SO") return &surfaces.front();
  if (name == "SI") return &surfaces.back();
  if (name.find_first_not_of("0123456789", 1) != std::string::npos) return nullptr;
  const std::size_t number = std::stoul(name.substr(1));
  return number < surfaces.size() ? &surfaces[number] : nullptr;
}

bool take_circle(Reading& reading, int line, const std::vector<std::string>& words) {
  Surface* surface = reading.design.surfaces.empty() ? nullptr : &reading.design.surfaces.back();
  std::size_t next = 1;
  if (next < words.size() && upper_case(words[next])[0] == 'S') surface = surface_of(reading, words[next++]);
  if (!surface) {
    reading.problem(line, "CIR: there is no surface '" + (next > 1 ? shown(words[1], 20) : "") + "'");
    return true;
  }
  if (next < words.size() && upper_case(words[next]) == "CLR") ++next;
  if (next >= words.size() || !parse_number(words[next])) return false;  // EDG, OBS, HOL: no clear radius
  surface->clear_radius_mm = reading.number(line, words[next], "CIR, clear radius");
  return true;
}

bool Decentre::take(Reading& reading, int line, const std::string& keyword, const std::string& value) {
  double* const target = keyword == "XDE"   ? &x
                         : keyword == "YDE" ? &y
                         : keyword == "ZDE" ? &z
                         : keyword == "ADE" ? &alpha_deg
                         : keyword == "BDE" ? &beta_deg
                         : keyword == "CDE" ? &gamma_deg
                                            : nullptr;
  if (!target) return false;
  *target = reading.number(line, value, keyword, keyword[1] == 'D' && keyword[0] <= 'C' ? 360 : 1e30);
  return true;
}

void Decentre::apply(Surface& surface) const {
  // CODE V turns clockwise about x and y, seen against these axes, and counter-clockwise about z.
  const optics::Motion motion = coordinate_break({x, y, z}, -alpha_deg, -beta_deg, gamma_deg);
  surface.before.reset();
  surface.after.reset();
  if (motion.is_nothing()) return;
  surface.before = motion;
  if (returns) surface.after = optics::inverse(motion);
}

bool take_asphere(Reading& reading, Surface& surface, int line, const std::string& keyword, const std::string& value) {
  if (keyword == "K") {
    surface.conic = reading.number(line, value, "K", 1e6);
    return true;
  }
  if (keyword.size() != 1 || keyword[0] < 'A' || keyword[0] > 'H') return false;
  const auto place = static_cast<std::size_t>(keyword[0] - 'A') + 2;  // even_asphere begins with r^2
  if (surface.even_asphere.size() < place) surface.even_asphere.resize(place);
  surface.even_asphere[place - 1] = reading.number(line, value, keyword);
  return true;
}

}  // namespace relign::lens_files
