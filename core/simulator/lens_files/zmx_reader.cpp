#include "lens_files/zmx_reader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "lens_files/text_lines.h"
#include "lens_files/zmx_configurations.h"
#include "lens_files/zmx_shape.h"

namespace relign::lens_files {
namespace {

// Lines without effect here: display, bookkeeping of solves, coatings, ray aiming, notes.
const std::set<std::string>& ignored_words() {
  static const std::set<std::string> kKeywords = {
      "VERS", "PFIL", "LANG", "NOTE", "ENVD", "GFAC", "RAIM", "PUSH", "SDMA", "ROPD", "PICB", "FWGN", "FWGT", "FWGL",
      "POLS", "GLRS", "GSTD", "NSCD", "COFN", "GCAT", "HIDE", "MIRR", "SLAB", "POPS", "MAZH", "COMM", "WAVN", "WWGN",
      "WWGT", "BLNK", "DBDT", "HYPR", "XFLD", "FIMP", "OEMA", "STAR", "SDIA", "RCPL", "PRIM", "EFFL", "COOR", "UNIQ",
      "TOLR", "WWAV", "CLMB", "SCBD", "GLCZ", "VPAR", "PZUP", "LTTP", "RSCE", "RWRE", "MEMA", "MNUM"};
  return kKeywords;
}

class ZmxReader {
 public:
  ZmxReader(std::string_view bytes, const std::string& file, int configuration)
      : lines_(text_lines(bytes, file)), reading_(file, "Zemax") {
    choose_configuration(lines_, reading_, configuration);
  }

  LensDesign read() {
    for (const TextLine& line : lines_) {
      const std::vector<std::string> words = words_of(line.text);
      if (words.empty()) continue;
      line_ = line.number;
      text_ = line.text;
      words_ = words;
      const std::string keyword = upper_case(words[0]);
      if (ignored_words().count(keyword) > 0) continue;
      const bool known = keyword == "SURF" ? begin_surface() : system_line(keyword) || surface_line(keyword);
      if (known) continue;
      const bool indented = text_[0] == ' ' || text_[0] == '\t';
      if (surfaces_seen_ && !indented)
        reading_.remark(line_, "after",
                        "not used: everything after the surfaces (merit function, tolerances, configurations)");
      else
        reading_.not_understood(line_, keyword, text_);
    }
    return whole();
  }

 private:
  std::string word(std::size_t i) const { return i < words_.size() ? words_[i] : ""; }
  double number(std::size_t i, const std::string& what, double limit = 1e30) {
    return reading_.number(line_, word(i), what, limit);
  }

  bool begin_surface() {
    end_surface();
    surfaces_seen_ = true;
    const int expected = static_cast<int>(reading_.design.surfaces.size());
    if (reading_.integer(line_, word(1), "SURF") != expected)
      reading_.problem(line_, "expected surface " + std::to_string(expected) + ", found '" + shown(word(1), 20) +
                                  "'; surfaces are missing or out of order");
    reading_.add_surface(line_, std::to_string(expected));
    return true;
  }

  bool system_line(const std::string& keyword) {
    static const std::set<std::string> kVignetting = {"VDXN", "VDYN", "VCXN", "VCYN", "VANN"};
    LensDesign& design = reading_.design;
    const auto aperture = [&](SystemAperture::Kind kind) {
      reading_.aperture(line_, keyword, kind, word(1));
      return true;
    };
    if (keyword == "MODE") {
      if (upper_case(word(1)) != "SEQ")
        reading_.problem(
            line_, "unsupported mode '" + shown(word(1), 20) + "'; only sequential lenses (MODE SEQ) are supported");
    } else if (keyword == "NAME") {
      const std::string text = trimmed(text_);
      design.title = trimmed(text.substr(std::min(text.size(), std::size_t{4})));
    } else if (keyword == "UNIT") {
      const auto unit = millimetres(upper_case(word(1)));
      if (!unit)
        reading_.problem(line_, "UNIT: unknown unit '" + shown(word(1), 20) + "'; allowed are MM, CM, IN, METER");
      unit_mm_ = unit.value_or(1);
      unit_stated_ = true;
    } else if (keyword == "ENPD") {
      return aperture(SystemAperture::entrance_pupil_diameter);
    } else if (keyword == "FNUM") {
      return aperture(SystemAperture::f_number);
    } else if (keyword == "OBNA") {
      return aperture(SystemAperture::object_na);
    } else if (keyword == "FLOA") {
      return aperture(SystemAperture::stop_size);
    } else if (keyword == "FTYP") {
      field_type_ = reading_.integer(line_, word(1), "FTYP");
      if (words_.size() > 3) fields_used_ = reading_.integer(line_, word(3), "FTYP, number of fields");
      if (words_.size() > 4) wavelengths_used_ = reading_.integer(line_, word(4), "FTYP, number of wavelengths");
      design.field.line = line_;
    } else if (keyword == "XFLN" || keyword == "YFLN" || keyword == "YFLD") {
      std::vector<double>& field = keyword == "XFLN" ? x_fields_ : y_fields_;
      field.clear();
      for (std::size_t i = 1; i < words_.size(); ++i) field.push_back(number(i, keyword));
    } else if (keyword == "WAVM" || keyword == "WAVL") {
      read_wavelength(keyword == "WAVM");
    } else if (keyword == "PWAV") {
      primary_ = reading_.integer(line_, word(1), "PWAV");
      primary_line_ = line_;
    } else if (kVignetting.count(keyword) > 0) {
      read_vignetting(keyword);
    } else {
      return false;
    }
    return true;
  }

  void read_vignetting(const std::string& keyword) {
    std::vector<double>& factors = vignetting_[keyword.substr(0, 3)];
    factors.clear();
    for (std::size_t i = 1; i < words_.size(); ++i) {
      factors.push_back(number(i, keyword, 10));
      if (factors.back() != 0) reading_.remark(line_, "vignetting", kVignettingRemark);
    }
  }

  // Decentre and compression of a field's beam, as fractions of the pupil; a rotated one (VAN) counts as unvignetted.
  FieldBeam field_beam(std::size_t i, double x, double y) const {
    const auto factor = [&](const char* word) {
      const auto list = vignetting_.find(word);
      return list == vignetting_.end() || i >= list->second.size() ? 0 : list->second[i];
    };
    FieldBeam beam;
    beam.x = x;
    beam.y = y;
    if (factor("VAN") != 0) return beam;
    beam.cut_below = factor("VCY") + factor("VDY");
    beam.cut_above = factor("VCY") - factor("VDY");
    beam.cut_left = factor("VCX") + factor("VDX");
    beam.cut_right = factor("VCX") - factor("VDX");
    return beam;
  }

  // WAVM: number, micrometres, weight. WAVL: micrometres of all.
  void read_wavelength(bool numbered) {
    if (numbered) {
      const int index = reading_.integer(line_, word(1), "WAVM");
      if (index < 1 || index > 100) {
        reading_.problem(line_, "WAVM: expected a wavelength number from 1 to 100, found '" + shown(word(1), 20) + "'");
        return;
      }
      wavelengths_um_.resize(std::max(wavelengths_um_.size(), static_cast<std::size_t>(index)));
      wavelength_lines_.resize(wavelengths_um_.size());
      wavelength_weights_.resize(wavelengths_um_.size(), 1);
      wavelength_weights_[static_cast<std::size_t>(index) - 1] = parse_number(word(3)).value_or(1);
      wavelengths_um_[static_cast<std::size_t>(index) - 1] = number(2, "WAVM, micrometres", 1000);
      wavelength_lines_[static_cast<std::size_t>(index) - 1] = line_;
      return;
    }
    wavelengths_um_.clear();
    for (std::size_t i = 1; i < words_.size(); ++i) wavelengths_um_.push_back(number(i, "WAVL, micrometres", 1000));
    wavelength_lines_.assign(wavelengths_um_.size(), line_);
    wavelength_weights_.assign(wavelengths_um_.size(), 1);
  }

  // Sets the primary wavelength and the others of the design: WAVM lists up to 24, of which FTYP states how many are
  // used.
  void choose_wavelength() {
    constexpr double kShortest_um = 0.1, kLongest_um = 100;
    LensDesign& design = reading_.design;
    if (wavelengths_um_.empty()) {
      reading_.problem(0, "no wavelength (WAVM) found");
      return;
    }
    if (primary_ < 1 || static_cast<std::size_t>(primary_) > wavelengths_um_.size()) {
      reading_.problem(primary_line_, "PWAV: the primary wavelength is number " + std::to_string(primary_) +
                                          ", but there are " + std::to_string(wavelengths_um_.size()));
      return;
    }
    const auto primary = static_cast<std::size_t>(primary_) - 1;
    const double wavelength_um = wavelengths_um_[primary];
    design.wavelengths_line = wavelength_lines_[primary];
    if (!(wavelength_um >= kShortest_um && wavelength_um <= kLongest_um))
      reading_.problem(
          design.wavelengths_line,
          "WAVM, WAVL: expected micrometres from 0.1 to 100 (green: 0.55), found " + shortest(wavelength_um));
    design.wavelength_nm = wavelength_um * 1000;
    const std::size_t used =
        wavelengths_used_ > 0 ? static_cast<std::size_t>(wavelengths_used_) : wavelengths_um_.size();
    for (std::size_t i = 0; i < std::min(used, wavelengths_um_.size()); ++i) {
      design.all_wavelengths_nm.push_back(wavelengths_um_[i] * 1000);
      design.wavelength_weights.push_back(wavelength_weights_[i]);
    }
  }

  bool surface_line(const std::string& keyword) {
    if (reading_.design.surfaces.empty()) return false;
    Surface& surface = reading_.design.surfaces.back();
    if (keyword == "TYPE") {
      shape_.set_type(line_, word(1));
    } else if (keyword == "CURV") {
      surface.curvature = number(1, "CURV");
    } else if (keyword == "CONI") {
      surface.conic = number(1, "CONI", 1e6);
    } else if (keyword == "PARM") {
      read_entry(&ZmxShape::set_parameter);
    } else if (keyword == "XDAT") {
      read_entry(&ZmxShape::set_extra);
    } else if (keyword == "DISZ") {
      surface.thickness_mm = upper_case(word(1)) == "INFINITY" ? kInfinite : number(1, "DISZ");
    } else if (keyword == "GLAS") {
      read_glass(surface);
    } else if (keyword == "DIAM") {
      if (surface.clear_radius_mm == 0 || !clear_from_aperture_) surface.clear_radius_mm = number(1, "DIAM");
      clear_from_aperture_ = false;
    } else if (keyword == "CLAP" || keyword == "FLAP") {
      if (number(1, keyword) != 0)
        reading_.remark(line_, "annular", "not used: the inner radius of an annular aperture");
      surface.clear_radius_mm = number(2, keyword);
      clear_from_aperture_ = true;
    } else if (keyword == "STOP") {
      surface.stop = true;
    } else {
      return false;
    }
    return true;
  }

  void read_entry(void (ZmxShape::*set)(int, int, double)) {
    const std::string keyword = upper_case(word(0));
    const int index = reading_.integer(line_, word(1), keyword);
    (shape_.*set)(line_, index, number(2, keyword + " " + shown(word(1), 20)));
  }

  void end_surface() {
    if (!reading_.design.surfaces.empty()) shape_.apply(reading_, reading_.design.surfaces.back());
    shape_ = ZmxShape();
  }

  // GLAS name kind surface nd Vd. Kind 1 is a model glass of nd and Vd, whatever its name; kind 2 is picked up from
  // another surface: if that is a model glass, the name ends in _BLANK and nd and Vd are valid. With a catalogue's name
  // nd and Vd are used only with --glass-from-file: Zemax writes 1.5 and 40 if it does not find the glass.
  void read_glass(Surface& surface) {
    constexpr double kUnknown_nd = 1.5, kUnknown_vd = 40;
    surface.glass_line = line_;
    surface.glass = word(1);
    surface.mirror = upper_case(surface.glass) == "MIRROR";
    if (surface.glass.empty()) reading_.problem(line_, "GLAS: missing name of the glass");
    if (surface.mirror) {
      surface.glass.clear();
      return;
    }
    const double kind = parse_number(word(2)).value_or(0);
    constexpr std::string_view kBlank = "_BLANK";  // suffix of model glasses
    const bool blank = surface.glass.size() > kBlank.size() &&
                       surface.glass.compare(surface.glass.size() - kBlank.size(), kBlank.size(), kBlank) == 0;
    if (kind != 1 && !blank) {
      if (kind > 2)
        reading_.remark(line_, "glass solve",
                        "not used: the solve of glass " + shown(surface.glass, 40) + ", kind " + shortest(kind));
      const double nd = parse_number(word(4)).value_or(0), vd = parse_number(word(5)).value_or(0);
      if (!(nd > 1 && nd < 5 && vd > 0) || (nd == kUnknown_nd && vd == kUnknown_vd)) return;
      surface.stated_nd = nd;
      surface.stated_vd = vd;
      return;
    }
    surface.glass.clear();
    surface.nd = number(4, "GLAS, nd of a model glass", 10);
    surface.vd = words_.size() > 5 ? number(5, "GLAS, Vd of a model glass", 1e4) : 0;
    if (surface.nd < 1)
      reading_.problem(line_, "surface " + surface.label + ": expected a model glass of index 1 or more, found " +
                                  shortest(surface.nd));
  }

  LensDesign whole() {
    end_surface();
    if (!surfaces_seen_) reading_.problem(0, "no surfaces (SURF) found; check that this is a complete Zemax lens file");
    read_fields();
    choose_wavelength();
    if (!unit_stated_) reading_.remark(0, "unit", "assumed: lengths in mm; the file has no UNIT");
    LensDesign result = reading_.finish();
    scale(result, unit_mm_);
    return result;
  }

  void read_fields() {
    FieldSize& field = reading_.design.field;
    const std::size_t count = std::max(x_fields_.size(), y_fields_.size());
    const std::size_t used = fields_used_ > 0 ? std::min(count, static_cast<std::size_t>(fields_used_)) : count;
    for (std::size_t i = 0; i < used; ++i)
      field.value = std::max(
          field.value, std::hypot(i < x_fields_.size() ? x_fields_[i] : 0, i < y_fields_.size() ? y_fields_[i] : 0));
    if (field.value == 0) return;
    for (std::size_t i = 0; i < used; ++i)
      reading_.design.fields.push_back(field_beam(i, (i < x_fields_.size() ? x_fields_[i] : 0) / field.value,
                                                  (i < y_fields_.size() ? y_fields_[i] : 0) / field.value));
    switch (field_type_) {
      case 0:
        field.kind = FieldSize::angle_deg;
        break;
      case 1:
        field.kind = FieldSize::object_height_mm;
        break;
      case 2:
        field.kind = FieldSize::image_height_mm;
        break;
      case 3:
        field.kind = FieldSize::real_image_height_mm;
        break;
      default:
        reading_.remark(field.line, "field type",
                        "not used: fields of type " + std::to_string(field_type_) +
                            " (supported are 0 angle, 1 object, 2 paraxial and 3 real image height)");
    }
  }

  std::vector<TextLine> lines_;
  Reading reading_;
  int line_ = 0;
  std::string text_;
  std::vector<std::string> words_;
  bool surfaces_seen_ = false, clear_from_aperture_ = false;
  ZmxShape shape_;
  double unit_mm_ = 1;
  bool unit_stated_ = false;
  int field_type_ = 0, fields_used_ = 0, wavelengths_used_ = 0;
  std::vector<double> x_fields_, y_fields_, wavelengths_um_, wavelength_weights_;
  std::map<std::string, std::vector<double>> vignetting_;  // VDX, VDY, VCX, VCY, VAN of the fields
  std::vector<int> wavelength_lines_;
  int primary_ = 1, primary_line_ = 0;
};

}  // namespace

LensDesign read_zmx_with_problems(std::string_view bytes, const std::string& file, int configuration) {
  return ZmxReader(bytes, file, configuration).read();
}

LensDesign read_zmx(std::string_view bytes, const std::string& file) {
  LensDesign design = read_zmx_with_problems(bytes, file);
  throw_if_any(design.problems);
  return design;
}

}  // namespace relign::lens_files
