#include "lens_files/codev_words.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

bool CodeVSystem::take(int line, const std::vector<std::string>& words) {
  static const std::set<std::string> kIgnoredWords = {"WTF", "INI", "POL", "RDM", "TEM", "PRE", "PIM", "WTA",
                                                      "CRA", "PTP", "POR", "PFR", "PUX", "PUY", "PUI"};
  static const std::set<std::string> kVignetting = {"VUX", "VLX", "VUY", "VLY"};
  static const std::set<std::string> kFields = {"XAN", "YAN", "XOB", "YOB", "XIM", "YIM", "XRI", "YRI"};
  constexpr double kShortest_nm = 100, kLongest_nm = 1e5;
  const std::string keyword = upper_case(words[0]);
  const std::string value = words.size() > 1 ? words[1] : "";
  const auto aperture = [&](SystemAperture::Kind kind) {
    reading_.aperture(line, keyword, kind, value);
    return true;
  };
  if (kIgnoredWords.count(keyword) > 0) return true;
  if (kFields.count(keyword) > 0) return take_fields(line, keyword, words);
  if (keyword == "EPD") return aperture(SystemAperture::entrance_pupil_diameter);
  if (keyword == "FNO") return aperture(SystemAperture::f_number);
  if (keyword == "NAO") return aperture(SystemAperture::object_na);
  if (keyword == "NA") return aperture(SystemAperture::image_na);
  if (keyword == "DIM") {
    const std::string unit = upper_case(value);
    // M, C and I in sequence files; listings spell them out.
    const auto factor = millimetres(unit == "M" ? "MM" : unit == "C" ? "CM" : unit == "I" ? "IN" : unit);
    if (!factor)
      reading_.problem(line, "DIM: unknown unit '" + shown(value, 20) + "'; allowed are M (mm), C (cm), I (inches)");
    unit_mm_ = factor.value_or(1);
    unit_stated_ = true;
  } else if (keyword == "WL") {
    wavelengths_nm_.clear();
    for (std::size_t i = 1; i < words.size(); ++i)
      wavelengths_nm_.push_back(reading_.number(line, words[i], "WL, nanometres", 1e6));
    for (const double wavelength : wavelengths_nm_)
      if (!(wavelength >= kShortest_nm && wavelength <= kLongest_nm))
        reading_.problem(line,
                         "WL: expected nanometres from 100 to 100000 (green: 550), found " + shortest(wavelength));
    reading_.design.wavelengths_line = line;
  } else if (keyword == "WTW") {
    weights_.clear();
    for (std::size_t i = 1; i < words.size(); ++i) weights_.push_back(parse_number(words[i]).value_or(1));
  } else if (keyword == "REF") {
    reference_ = reading_.integer(line, value, "REF");
    reference_line_ = line;
  } else if (kVignetting.count(keyword) > 0) {
    std::vector<double>& factors = vignetting_[keyword];
    factors.clear();
    for (std::size_t i = 1; i < words.size(); ++i) {
      factors.push_back(reading_.number(line, words[i], keyword, 10));
      if (factors.back() != 0) reading_.remark(line, "vignetting", kVignettingRemark);
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
               : keyword.compare(1, 2, "RI") == 0 ? FieldSize::real_image_height_mm
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
  for (std::size_t i = 0; field.value != 0 && i < std::max(x_fields_.size(), y_fields_.size()); ++i) {
    const auto factor = [&](const char* word) {
      const auto list = vignetting_.find(word);
      return list == vignetting_.end() || i >= list->second.size() ? 0 : list->second[i];
    };
    design.fields.push_back({(i < x_fields_.size() ? x_fields_[i] : 0) / field.value,
                             (i < y_fields_.size() ? y_fields_[i] : 0) / field.value, factor("VLY"), factor("VUY"),
                             factor("VLX"), factor("VUX")});
  }
  if (wavelengths_nm_.empty()) {
    reading_.problem(0, "no wavelength (WL) found");
  } else if (reference_wavelength_nm() == 0) {
    reading_.problem(reference_line_, "REF: the reference wavelength is number " + std::to_string(reference_) +
                                          ", but there are " + std::to_string(wavelengths_nm_.size()));
  }
  design.wavelength_nm = reference_wavelength_nm();
  design.all_wavelengths_nm = wavelengths_nm_;
  design.wavelength_weights = weights_;
  design.wavelength_weights.resize(wavelengths_nm_.size(), 1);
  if (!unit_stated_) reading_.remark(0, "unit", "assumed: lengths in mm; the file has no DIM");
  LensDesign result = reading_.finish();
  scale(result, unit_mm_);
  return result;
}

void take_glass(Surface& surface, int line, const std::string& word) {
  const std::string name = upper_case(word);
  if (name == "AIR" || name == "REFR" || name.empty()) return;
  if (name == "REFL") {
    surface.mirror = true;
    surface.glass_line = line;
    return;
  }
  surface.glass_line = line;
  if (const std::size_t colon = word.find(':'); colon != std::string::npos) {
    const auto nd = parse_number(word.substr(0, colon)), vd = parse_number(word.substr(colon + 1));
    if (nd && vd && *nd >= 1 && *nd < 5 && *vd > 0) {
      surface.nd = *nd;
      surface.vd = *vd;
      return;
    }
  }
  surface.glass = word;
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
    reading.problem(line, "CIR: unknown surface '" + (next > 1 ? shown(words[1], 20) : "") + "'");
    return true;
  }
  if (next < words.size() && upper_case(words[next]) == "CLR") ++next;
  if (next >= words.size() || !parse_number(words[next])) return false;  // EDG, OBS, HOL: not the clear aperture
  surface->clear_radius_mm = reading.number(line, words[next], "CIR, semi-diameter");
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
  // CODE V: left-handed about x and y, right-handed about z.
  const optics::Motion motion = coordinate_break({x, y, z}, -alpha_deg, -beta_deg, gamma_deg);
  surface.before.reset();
  surface.after.reset();
  if (motion.is_identity()) return;
  surface.before = motion;
  if (returns) surface.after = optics::inverse(motion);
}

bool take_asphere(Reading& reading, Surface& surface, int line, const std::string& keyword, const std::string& value) {
  if (keyword == "K") {
    surface.conic = reading.number(line, value, "K", 1e6);
    return true;
  }
  // I is not a coefficient: J follows H.
  static const std::string kLetters = "ABCDEFGHJ";
  const std::size_t letter = keyword.size() == 1 ? kLetters.find(keyword) : std::string::npos;
  if (letter == std::string::npos) return false;
  set_term(surface, 2 * static_cast<int>(letter) + 4, reading.number(line, value, keyword));
  return true;
}

bool SpecialSurface::take(Reading& reading, const Surface& surface, int line, const std::vector<std::string>& words,
                          std::size_t at) {
  const auto word = [&](std::size_t i) { return i < words.size() ? upper_case(words[i]) : std::string(); };
  const std::string keyword = word(0);
  if (keyword == "SCC") return kind_ != none;  // control codes of the coefficients, for optimisation
  if (keyword == "SPS") {
    kind_ = word(at) == "ODD" ? odd : word(at) == "QBF" ? q_bfs : word(at) == "QCN" ? q_con : none;
    line_ = line;
    terms_.clear();
    radius_ =
        words.size() > at + 1 ? reading.number(line, words[at + 1], "SPS " + word(at) + ", normalisation radius") : 0;
    if (kind_ == none)
      reading.problem(line, "surface " + surface.label + ": unsupported 'SPS " + shown(word(at), 20) +
                                "'; supported are SPS ODD, SPS QBF and SPS QCN");
    return true;
  }
  if (keyword != "SCO" || kind_ == none) return false;
  constexpr int kMaxTerms = 30, kRadius = 33;
  const std::string name = word(at);
  const double value = reading.number(line, word(at + 1), "SCO " + shown(name, 20));
  if (is_q_type()) {
    take_q_coefficient(reading, surface, line, name, value);
    return true;
  }
  const auto counted = [&](std::size_t letters) {
    return name.size() > letters && name.size() < letters + 3 &&
                   name.find_first_not_of("0123456789", letters) == std::string::npos
               ? std::stoi(name.substr(letters))
               : 0;
  };
  int number = name == "K" ? 1 : name == "NRADIUS" ? kRadius : 0;
  if (name.compare(0, 2, "AR") == 0) number = counted(2) > 0 ? counted(2) + 1 : 0;
  if (name.compare(0, 1, "C") == 0) number = counted(1);
  if (number == 1)
    conic_ = reading.number(line, word(at + 1), "SCO K", 1e6);
  else if (number == kRadius)
    radius_ = value;
  else if (number >= 2 && number <= kMaxTerms + 1)
    terms_[number - 1] = {line, value};
  else
    reading.not_understood(line, "SCO", keyword + " " + name);
  return true;
}

void SpecialSurface::take_q_coefficient(Reading& reading, const Surface& surface, int line, const std::string& name,
                                        double value) {
  const std::string letters = kind_ == q_bfs ? "QB" : "QC";
  const bool numbered = name.size() > 2 && name.size() < 5 && name.compare(0, 2, letters) == 0 &&
                        name.find_first_not_of("0123456789", 2) == std::string::npos;
  const int power = numbered ? std::stoi(name.substr(2)) : 0;  // of the lowest power of r in the term
  if (name == "K")
    conic_ = reading.number(line, shortest(value), "SCO K", 1e6);
  else if (name == "NRADIUS")
    radius_ = value;
  else if (power >= 4 && power % 2 == 0 && power < 4 + 2 * kMaxQTerms)
    terms_[(power - 4) / 2] = {line, value};
  else
    reading.problem(line, "surface " + surface.label + ": unsupported 'SCO " + shown(name, 20) + "' of SPS " +
                              (kind_ == q_bfs ? "QBF" : "QCN") + "; supported are K, NRADIUS and " + letters + "4, " +
                              letters + "6, ... by name");
}

void SpecialSurface::apply_q_type(Reading& reading, Surface& surface) const {
  QAsphere asphere;
  asphere.radius_mm = radius_;
  for (const auto& [number, term] : terms_) {
    asphere.coefficients.resize(static_cast<std::size_t>(number) + 1);
    asphere.coefficients.back() = term.second;
  }
  while (!asphere.coefficients.empty() && asphere.coefficients.back() == 0) asphere.coefficients.pop_back();
  if (asphere.coefficients.empty()) return;
  const std::string kind = kind_ == q_bfs ? "QBF" : "QCN", letters = kind_ == q_bfs ? "QB" : "QC";
  if (!(radius_ > 0))
    reading.problem(line_, "surface " + surface.label + ": SPS " + kind +
                               " needs a normalisation radius above 0, found " + shortest(radius_) +
                               "; set SCO NRADIUS");
  reading.remark(line_, "SPS " + kind,
                 "surface " + surface.label + ": SPS " + kind + " is read as Forbes's " +
                     (kind_ == q_bfs ? "Q_bfs" : "Q_con") + ", " + letters + "4, " + letters +
                     "6, ... as his a0, a1, ...");
  (kind_ == q_bfs ? surface.q_bfs : surface.q_con) = asphere;
}

void SpecialSurface::apply(Reading& reading, Surface& surface) const {
  if (kind_ == none) return;
  if (is_q_type()) {
    // K as a separate word of the surface applies if SCO has none.
    if (conic_ != 0) surface.conic = conic_;
    apply_q_type(reading, surface);
    return;
  }
  surface.conic = conic_;
  const double radius = radius_ == 0 ? 1 : radius_;  // 0: not normalised
  if (!(radius > 0))
    reading.problem(line_, "surface " + surface.label +
                               ": expected a normalisation radius above 0, or 0 for none, found " + shortest(radius_));
  for (const auto& [power, term] : terms_) {
    if (term.second == 0) continue;
    if (power == 1)
      reading.problem(term.first, "surface " + surface.label + " has a term of r, " + shortest(term.second) +
                                      " (a cone); supported are terms from r^2 up");
    else if (const double coefficient = term.second / std::pow(radius, power); std::isfinite(coefficient))
      set_term(surface, power, coefficient);
    else if (radius > 0)
      reading.problem(term.first, "surface " + surface.label + ": the term of r^" + std::to_string(power) +
                                      " is too large with a normalisation radius of " + shortest(radius));
  }
}

}  // namespace relign::lens_files
