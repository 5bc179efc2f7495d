#include "lens_files/listing_reader.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/text.h"
#include "lens_files/codev_words.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

bool is_infinite(const std::string& word) { return upper_case(word).compare(0, 4, "INFI") == 0; }

// Columns CCY, THC and GLC: variables and solves.
bool is_flag(const std::string& word) {
  const bool number = word.size() <= 3 && word.find_first_not_of("0123456789") == std::string::npos;
  return number || word == "PIM" || word == "HMY" || word == "UMY" || word == "PUY" || word == "ICY" || word == "APY";
}

class ListingReader {
 public:
  ListingReader(std::string_view bytes, const std::string& file)
      : lines_(text_lines(bytes, file)), reading_(file, "CODE V listing"), system_(reading_) {}

  LensDesign read() {
    for (const TextLine& line : lines_) {
      const std::vector<std::string> words = words_of(line.text);
      if (words.empty()) continue;
      line_ = line.number;
      text_ = line.text;
      if (!section(words) && !inside(words)) reading_.not_understood(line_, upper_case(words[0]), text_);
    }
    decentre_applied();
    if (reading_.design.surfaces.size() < 3)
      reading_.problem(0, "no surface table (RDY, THI, ... OBJ: to IMG:) found; check that this is a CODE V listing");
    else if (!image_seen_)
      reading_.problem(reading_.design.surfaces.back().line,
                       "the row of the image (IMG:) is missing; check that the file is complete");
    take_indices();
    return system_.finish();
  }

 private:
  enum class Section { title, surfaces, specification, apertures, indices, solves, first_order, other };

  bool section(const std::vector<std::string>& words) {
    const std::string text = upper_case(trimmed(text_));
    const auto begins = [&](const char* start) { return text.compare(0, std::string(start).size(), start) == 0; };
    if (begins("RDY") && text.find("THI") != std::string::npos)
      section_ = Section::surfaces;
    else if (begins("SPECIFICATION DATA"))
      section_ = Section::specification;
    else if (begins("APERTURE DATA"))
      section_ = Section::apertures;
    else if (begins("REFRACTIVE INDICES"))
      section_ = Section::indices;
    else if (begins("SOLVES") || begins("PICKUPS") || begins("NO PICKUPS") || begins("NO SOLVES"))
      section_ = Section::solves;
    else if (begins("INFINITE CONJUGATES"))
      section_ = Section::first_order;
    else if (begins("AT USED CONJUGATES") || begins("FINITE CONJUGATES"))
      section_ = Section::other;
    else
      return false;
    static_cast<void>(words);
    return true;
  }

  bool inside(const std::vector<std::string>& words) {
    switch (section_) {
      case Section::title:
        if (reading_.design.title.empty()) reading_.design.title = trimmed(text_);
        return true;
      case Section::surfaces:
        return surface_row(words) || surface_extra();
      case Section::specification:
        return system_.take(line_, words);
      case Section::apertures:
        if (upper_case(words[0]) == "CIR") return take_circle(reading_, line_, words);
        return upper_case(words[0]) == "CA";
      case Section::indices:
        index_row(words);
        return true;
      case Section::solves:
        return true;
      case Section::first_order:
        return first_order_row(words);
      case Section::other:
        reading_.remark(line_, "conjugates", "not read: first-order values at the used conjugates");
        return true;
    }
    return false;
  }

  // "> OBJ:  INFINITY  INFINITY  100 100", "1:  10.79  1.5  487490.704058  0 0 0".
  bool surface_row(const std::vector<std::string>& words) {
    std::size_t at = words[0] == ">" ? 1 : 0;
    if (at >= words.size() || words[at].size() < 2 || words[at].back() != ':') return false;
    const std::string label = upper_case(words[at].substr(0, words[at].size() - 1));
    const bool numbered = label.find_first_not_of("0123456789") == std::string::npos;
    if (!numbered && label != "OBJ" && label != "STO" && label != "IMG") return false;
    if (at + 2 >= words.size() || (!is_infinite(words[at + 1]) && !parse_number(words[at + 1]))) return false;
    decentre_applied();
    const std::size_t count = reading_.design.surfaces.size();
    if (label == "OBJ" ? count != 0 : count == 0 || (numbered && label != std::to_string(count)))
      reading_.problem(line_, "expected surface " + std::to_string(count) + ", found '" + shown(label, 20) +
                                  "'; rows are missing or out of order");
    if (image_seen_) reading_.problem(line_, "a surface after the image (IMG:)");
    image_seen_ = image_seen_ || label == "IMG";
    Surface& surface = reading_.add_surface(line_, label);
    surface.stop = label == "STO";
    if (!is_infinite(words[at + 1])) {
      const double radius = reading_.number(line_, words[at + 1], "radius");
      surface.curvature = radius == 0 || std::fabs(radius) >= kInfinite ? 0 : 1 / radius;
    }
    surface.thickness_mm = is_infinite(words[at + 2]) ? kInfinite : reading_.number(line_, words[at + 2], "thickness");
    at += 3;
    if (at < words.size() && upper_case(words[at]).compare(0, 3, "REF") == 0) take_glass(surface, line_, words[at++]);
    if (at < words.size() && !is_flag(upper_case(words[at]))) take_glass(surface, line_, words[at++]);
    for (; at < words.size(); ++at)
      if (!is_flag(upper_case(words[at]))) reading_.not_understood(line_, "row " + words[at], text_);
    return true;
  }

  // Lines below a row: "K : -0.5  KC : 100", "A :0.1E-03  B : ...", "XDE: 0  YDE: 0.1  ZDE: 0  DAR".
  bool surface_extra() {
    if (reading_.design.surfaces.empty()) return false;
    Surface& surface = reading_.design.surfaces.back();
    std::string spaced;
    for (const char letter : text_) spaced += letter == ':' ? std::string(" : ") : std::string(1, letter);
    const std::vector<std::string> words = words_of(spaced);
    bool understood = false;
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::string keyword = upper_case(words[i]);
      const bool has_value = i + 2 < words.size() && words[i + 1] == ":";
      if (keyword == "DAR") {
        decentre_.returns = understood = true;
      } else if (keyword == "ASP" || keyword == "CON" || keyword == "SPH" || keyword == "SLB") {
        understood = true;
      } else if (keyword == "CYL" || keyword == "YTO" || keyword == "BEN" || keyword == "REV" || keyword == "SPS") {
        reading_.problem(line_,
                         "surface " + surface.label + ": " + keyword +
                             " is not supported; supported are spheres, conics, even aspheres and decentres with or "
                             "without DAR");
        understood = true;
      } else if (has_value && (decentre_.take(reading_, line_, keyword, words[i + 2]) ||
                               take_asphere(reading_, surface, line_, keyword, words[i + 2]))) {
        understood = true;
      } else if (has_value && (keyword == "KC" || keyword == "IC" || keyword == "CUF" || keyword == "CCF" ||
                               (keyword.size() == 2 && keyword[1] == 'C') ||
                               (keyword.size() == 3 && keyword.compare(1, 2, "DC") == 0))) {
        understood = true;
      }
    }
    return understood;
  }

  void decentre_applied() {
    if (!reading_.design.surfaces.empty()) decentre_.apply(reading_.design.surfaces.back());
    decentre_ = Decentre();
  }

  // "GLASS CODE  656.27  589.00  486.13", then one row a glass.
  void index_row(const std::vector<std::string>& words) {
    if (upper_case(words[0]) == "GLASS") {
      index_wavelengths_.clear();
      for (const std::string& word : words)
        if (const auto value = parse_number(word)) index_wavelengths_.push_back(*value);
      return;
    }
    std::vector<double>& row = indices_[upper_case(words[0])];
    row.clear();
    for (std::size_t i = 1; i < words.size(); ++i)
      row.push_back(reading_.number(line_, words[i], "refractive index", 100));
    if (row.size() != index_wavelengths_.size())
      reading_.problem(line_, "refractive indices of '" + shown(words[0], 40) + "': expected " +
                                  std::to_string(index_wavelengths_.size()) + ", one per wavelength, found " +
                                  std::to_string(row.size()));
  }

  void take_indices() {
    const double wavelength = system_.reference_wavelength_nm();
    for (Surface& surface : reading_.design.surfaces) {
      // The table has catalogue glasses with or without the catalogue's name.
      for (const auto& [name, row] : indices_) {
        const std::string own = upper_case(surface.glass);
        if (own.empty() || (name != own && name.substr(0, name.rfind('_')) != own)) continue;
        for (std::size_t i = 0; i < std::min(row.size(), index_wavelengths_.size()); ++i)
          if (std::fabs(index_wavelengths_[i] - wavelength) < 0.05) surface.index = row[i];
      }
    }
  }

  // "EFL 2.8950"; below ENTRANCE PUPIL and EXIT PUPIL: DIA, THI; below PARAXIAL IMAGE: HT, ANG.
  bool first_order_row(const std::vector<std::string>& words) {
    const std::string text = upper_case(trimmed(text_));
    for (const char* heading : {"PARAXIAL IMAGE", "ENTRANCE PUPIL", "EXIT PUPIL"})
      if (text == heading) {
        heading_ = heading;
        return true;
      }
    static const std::map<std::string, std::string> kNames = {{"EFL", "focal_length"},
                                                              {"BFL", "back_focal_length"},
                                                              {"FFL", "front_focal_length"},
                                                              {"FNO", "f_number"},
                                                              {"IMG", "image_distance"},
                                                              {"OAL", "overall_length"},
                                                              {"PARAXIAL IMAGE HT", "paraxial_image_height"},
                                                              {"PARAXIAL IMAGE ANG", ""},
                                                              {"ENTRANCE PUPIL DIA", "entrance_pupil_diameter"},
                                                              {"ENTRANCE PUPIL THI", "entrance_pupil_z"},
                                                              {"EXIT PUPIL DIA", "exit_pupil_diameter"},
                                                              {"EXIT PUPIL THI", "exit_pupil_from_last"}};
    const std::string key = (heading_.empty() ? "" : heading_ + " ") + upper_case(words[0]);
    const auto known = kNames.find(key);
    if (known == kNames.end()) return false;
    if (!known->second.empty())
      if (const auto value = parse_number(words.back())) reading_.design.published[known->second] = *value;
    return true;
  }

  const std::vector<TextLine> lines_;
  Reading reading_;
  CodeVSystem system_;
  Section section_ = Section::title;
  int line_ = 0;
  std::string text_, heading_;
  bool image_seen_ = false;
  Decentre decentre_;
  std::vector<double> index_wavelengths_;
  std::map<std::string, std::vector<double>> indices_;
};

}  // namespace

LensDesign read_listing_with_problems(std::string_view bytes, const std::string& file) {
  return ListingReader(bytes, file).read();
}

LensDesign read_listing(std::string_view bytes, const std::string& file) {
  LensDesign design = read_listing_with_problems(bytes, file);
  throw_if_any(design.problems);
  return design;
}

}  // namespace relign::lens_files
