#include "lens_files/seq_reader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "lens_files/codev_words.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

struct Command {
  int line = 0;
  std::string text;
  std::vector<std::string> words;
};

// `;` separates commands, `&` at the end continues on the next line, `!` begins a comment; none of them within quotes.
std::vector<Command> commands_of(const std::vector<TextLine>& lines) {
  std::vector<Command> commands;
  std::string text;
  int begun = 0;
  const auto end_command = [&] {
    std::vector<std::string> words = words_of(text);
    if (!words.empty()) commands.push_back({begun, trimmed(text), std::move(words)});
    text.clear();
  };
  for (const TextLine& line : lines) {
    if (text.empty()) begun = line.number;
    char quote = '\0';
    for (const char letter : line.text) {
      if (quote == '\0' && letter == '!') break;
      if (quote == '\0' && letter == ';') {
        end_command();
        begun = line.number;
        continue;
      }
      if (letter == quote)
        quote = '\0';
      else if (quote == '\0' && (letter == '"' || letter == '\''))
        quote = letter;
      text += letter;
    }
    const std::string so_far = trimmed(text);
    if (!so_far.empty() && so_far.back() == '&')
      text = so_far.substr(0, so_far.size() - 1) + " ";
    else
      end_command();
  }
  end_command();
  return commands;
}

class SeqReader {
 public:
  SeqReader(std::string_view bytes, const std::string& file, int position)
      : position_(std::max(1, position)),
        position_chosen_(position > 0),
        commands_(commands_of(text_lines(bytes, file))),
        reading_(file, "CODE V"),
        system_(reading_) {}

  LensDesign read() {
    for (Command command : commands_) {
      const std::string keyword = upper_case(command.words[0]);
      if (in_private_glasses_)
        private_glass(command, keyword);
      else if (!is_of_position(command))
        continue;
      else if (!is_surface(command, keyword) && !surface_property(command, keyword) && !global(command, keyword) &&
               !system_.take(command.line, command.words))
        reading_.not_understood(command.line, keyword, command.text);
    }
    if (reading_.design.surfaces.empty())
      reading_.problem(0, "no surfaces (SO, S, SI) found; check that this is a complete CODE V sequence file");
    else if (!image_seen_)
      reading_.problem(reading_.design.surfaces.back().line,
                       "the image surface (SI) is missing; check that the file is complete");
    finish_surface();
    assume_stop();
    use_private_glasses();
    check_curvatures();
    if (position_ > positions_)
      reading_.problem(
          0, "unknown zoom position " + std::to_string(position_) + "; the file has " + std::to_string(positions_));
    return system_.finish();
  }

 private:
  static std::string word(const Command& command, std::size_t i) {
    return i < command.words.size() ? command.words[i] : "";
  }

  // SO, S or SI: radius (or curvature), thickness, glass.
  bool is_surface(const Command& command, const std::string& keyword) {
    if (keyword != "S" && keyword != "SO" && keyword != "SI") return false;
    finish_surface();
    if (image_seen_) reading_.problem(command.line, keyword + " after the image surface (SI)");
    if (keyword == "SO" && !reading_.design.surfaces.empty())
      reading_.problem(command.line, "SO: the object surface must be the first one");
    image_seen_ = image_seen_ || keyword == "SI";
    if (keyword != "SO" && reading_.design.surfaces.empty())
      reading_.add_surface(command.line, "SO").thickness_mm = kInfinite;
    const std::string label = keyword == "S" ? "S" + std::to_string(reading_.design.surfaces.size()) : keyword;
    Surface& surface = reading_.add_surface(command.line, label);
    if (command.words.size() > 1) surface.curvature = curvature(command.line, word(command, 1));
    if (command.words.size() > 2) surface.thickness_mm = thickness(command.line, word(command, 2));
    const bool model = take_model_glass(command, surface);
    if (command.words.size() > 3 && !model) take_glass(surface, command.line, word(command, 3));
    if (command.words.size() > (model ? 5U : 4U)) reading_.not_understood(command.line, "S", command.text);
    return true;
  }

  // nd and Vd instead of a name. (A code such as 517642 is a single large number.)
  bool take_model_glass(const Command& command, Surface& surface) {
    const auto nd = parse_number(word(command, 3)), vd = parse_number(word(command, 4));
    if (!nd || !vd || !(*nd >= 1 && *nd < 5) || !(*vd > 0)) return false;
    surface.glass_line = command.line;
    surface.nd = *nd;
    surface.vd = *vd;
    return true;
  }

  double curvature(int line, const std::string& text) {
    const double value = reading_.number(line, text, radius_mode_ ? "radius" : "curvature");
    if (!radius_mode_ && !mode_stated_ && value != 0) {
      assumed_curvatures_ = true;
      reading_.remark(line, "curvatures",
                      "assumed: surface values are curvatures, CODE V's default; the file has no RDM before them");
    }
    if (!radius_mode_) return value;
    return value == 0 || std::fabs(value) >= kInfinite ? 0 : 1 / value;
  }

  double thickness(int line, const std::string& text) {
    const double value = reading_.number(line, text, "thickness");
    return std::fabs(value) >= kInfinite ? kInfinite : value;
  }

  // A word after a surface, or with the surface named: "STO", "THI SI -0.04".
  bool surface_property(const Command& command, const std::string& keyword) {
    if (reading_.design.surfaces.empty()) return false;
    std::size_t at = 1;
    Surface* surface = &reading_.design.surfaces.back();
    if (Surface* named = surface_of(reading_, word(command, 1))) {
      surface = named;
      at = 2;
    }
    const std::string value = word(command, at);
    const bool is_current = surface == &reading_.design.surfaces.back();
    if (keyword == "STO") {
      surface->stop = true;
    } else if (keyword == "CIR") {
      return take_circle(reading_, command.line, command.words);
    } else if (keyword == "RDY") {
      const double radius = reading_.number(command.line, value, keyword);
      surface->curvature = radius == 0 || std::fabs(radius) >= kInfinite ? 0 : 1 / radius;
    } else if (keyword == "CUY") {
      surface->curvature = reading_.number(command.line, value, keyword);
    } else if (keyword == "THI") {
      surface->thickness_mm = thickness(command.line, value);
    } else if (keyword == "GLA") {
      take_glass(*surface, command.line, value);
    } else if (keyword == "ASP" || keyword == "CON" || keyword == "SPH" || keyword == "SLB" || keyword == "CCY" ||
               keyword == "THC" || keyword == "GLC" || keyword == "KC" || keyword == "CUF" || keyword == "CCF") {
      return true;
    } else if (keyword == "DAR") {
      decentre_.returns = is_current;
      return is_current;
    } else if (keyword == "BEN" || keyword == "REV" || keyword == "RET" || keyword == "GLB" || keyword == "CYL" ||
               keyword == "YTO" || keyword == "XTO" || keyword == "DIF" || keyword == "GRX") {
      reading_.problem(command.line,
                       "surface " + surface->label + ": " + keyword +
                           " is not supported; supported are spheres, conics, aspheres and decentres with or "
                           "without DAR");
    } else if (is_current && special_.take(reading_, *surface, command.line, command.words, at)) {
      return true;
    } else if (is_current && decentre_.take(reading_, command.line, keyword, value)) {
      return true;
    } else {
      return take_asphere(reading_, *surface, command.line, keyword, value);
    }
    return true;
  }

  bool global(const Command& command, const std::string& keyword) {
    if (keyword == "RDM") {
      const std::string value = upper_case(word(command, 1));
      radius_mode_ = value.empty() || value[0] != 'N';
      mode_stated_ = true;
    } else if (keyword == "TITLE" || keyword == "TIT") {
      reading_.design.title = word(command, 1);
    } else if (keyword == "PRV") {
      in_private_glasses_ = true;
    } else if (keyword == "ZOO") {
      zoom(command);
    } else if (keyword == "POS") {
      return true;
    } else {
      return keyword == "LEN" || keyword == "GO" || keyword == "CA" || keyword == "EOS";
    }
    return true;
  }

  // "THI S5 Z2 12.5" applies to one zoom position: removes the Z word; false for other positions.
  bool is_of_position(Command& command) const {
    for (std::size_t i = 1; i < command.words.size() && i < 3; ++i) {
      const std::string text = upper_case(command.words[i]);
      if (text.size() < 2 || text.size() > 4 || text[0] != 'Z' ||
          text.find_first_not_of("0123456789", 1) != std::string::npos)
        continue;
      if (std::stoi(text.substr(1)) != position_) return false;
      command.words.erase(command.words.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return true;
  }

  // ZOO 3; ZOO THI S5 1.0 2.0 3.0; ZOO EPD 5 4 3: executes the value of the position as a command.
  void zoom(const Command& command) {
    static const std::set<std::string> kSupported = {"THI", "RDY", "CUY", "GLA", "K", "A",   "B",   "C",  "D",
                                                     "E",   "F",   "G",   "H",   "J", "EPD", "FNO", "NA", "NAO"};
    static const std::set<std::string> kIgnoredWords = {"TIT", "WTF", "WTW", "THC", "CCY", "GLC", "KC",
                                                        "VUX", "VLX", "VUY", "VLY", "STA", "PFR", "WTZ"};
    const std::string operand = upper_case(word(command, 1));
    if (const auto count = parse_number(operand); count && *count >= 1 && *count <= 1000) {
      positions_ = static_cast<int>(*count);
      if (positions_ > 1 && !position_chosen_)
        reading_.remark(command.line, "zoom",
                        "not used: further zoom positions; the lens is read at position 1 of " +
                            std::to_string(positions_) + " (--configuration selects another)");
      return;
    }
    if (kIgnoredWords.count(operand) > 0) return;
    Command own = {command.line, command.text, {operand}};
    std::size_t first = 2;
    if (first < command.words.size() && !parse_number(word(command, first)) && operand != "GLA")
      own.words.push_back(word(command, first++));
    else if (operand == "GLA" && surface_of(reading_, word(command, first)))
      own.words.push_back(word(command, first++));
    const std::string base = word(command, first),
                      value = word(command, first + static_cast<std::size_t>(position_) - 1);
    if (position_ == 1 || value == base) return;
    own.words.push_back(value);
    if (kSupported.count(operand) == 0)
      reading_.problem(command.line, "ZOO " + shown(operand, 20) + " differs between zoom position " +
                                         std::to_string(position_) + " and 1; it is not supported");
    else if (!surface_property(own, operand) && !system_.take(own.line, own.words))
      reading_.not_understood(command.line, "ZOO", command.text);
  }

  // PRV; PWL wavelengths; 'name' indices; END.
  void private_glass(const Command& command, const std::string& keyword) {
    if (keyword == "END") {
      in_private_glasses_ = false;
      return;
    }
    std::vector<double> values;
    for (std::size_t i = 1; i < command.words.size(); ++i)
      values.push_back(reading_.number(command.line, command.words[i], "private glass " + shown(keyword, 20)));
    if (keyword == "PWL")
      private_wavelengths_ = values;
    else
      private_indices_[keyword] = {command.line, private_wavelengths_, values};
  }

  void finish_surface() {
    if (!reading_.design.surfaces.empty()) {
      decentre_.apply(reading_.design.surfaces.back());
      special_.apply(reading_, reading_.design.surfaces.back());
    }
    decentre_ = Decentre();
    special_ = SpecialSurface();
  }

  // CODE V puts the stop on surface 1 of a new lens.
  void assume_stop() {
    std::vector<Surface>& surfaces = reading_.design.surfaces;
    for (const Surface& surface : surfaces)
      if (surface.stop) return;
    if (surfaces.size() < 3) return;
    surfaces[1].stop = true;
    reading_.remark(0, "stop", "assumed: the stop is surface S1, CODE V's default; the file has no STO");
  }

  // Radii read as curvatures (a file without RDM) give spheres smaller than their semi-diameters, or than the entrance
  // pupil.
  void check_curvatures() {
    if (!assumed_curvatures_) return;
    const SystemAperture& aperture = reading_.design.aperture;
    double pupil = aperture.kind == SystemAperture::entrance_pupil_diameter ? aperture.value / 2 : 0;
    for (const Surface& surface : reading_.design.surfaces) {
      const double reach = std::max(surface.clear_radius_mm, pupil);
      if (surface.curvature == 0) continue;
      pupil = 0;  // only the first curved face is certain to be this wide
      if (std::fabs(surface.curvature) * reach <= 1 || surface.conic <= -1) continue;
      reading_.problem(surface.line, "surface " + surface.label + ": a curvature of " + shortest(surface.curvature) +
                                         " is a sphere smaller than the beam; without RDM, values are curvatures; "
                                         "if these are radii, write RDM before the surfaces");
      return;
    }
  }

  // A private glass applies if the reference wavelength is among its own; else its name is left for catalogues.
  void use_private_glasses() {
    const double wavelength = system_.reference_wavelength_nm();
    std::set<std::string> used;
    for (Surface& surface : reading_.design.surfaces) {
      const auto glass = private_indices_.find(upper_case(surface.glass));
      if (glass == private_indices_.end()) continue;
      const PrivateGlass& own = glass->second;
      used.insert(glass->first);
      for (std::size_t i = 0; i < std::min(own.wavelengths.size(), own.indices.size()); ++i)
        if (std::fabs(own.wavelengths[i] - wavelength) < 0.05) surface.index = own.indices[i];
      if (surface.index == 0)
        reading_.remark(own.line, "private glass " + glass->first,
                        "not used: private glass '" + shown(surface.glass, 40) +
                            "' has no index at the reference wavelength, " + shortest(wavelength) + " nm");
    }
    for (const auto& [name, own] : private_indices_)
      if (used.count(name) == 0)
        reading_.remark(own.line, "private glass " + name,
                        "not used: private glass '" + shown(name, 40) + "'; no surface uses it");
  }

  struct PrivateGlass {
    int line = 0;
    std::vector<double> wavelengths, indices;
  };

  int position_ = 1, positions_ = 1;  // of the zoom
  bool position_chosen_ = false;
  const std::vector<Command> commands_;
  Reading reading_;
  CodeVSystem system_;
  // CODE V starts in curvature mode; most sequence files that it writes begin with RDM.
  bool radius_mode_ = false, mode_stated_ = false, assumed_curvatures_ = false, image_seen_ = false,
       in_private_glasses_ = false;
  Decentre decentre_;
  SpecialSurface special_;
  std::vector<double> private_wavelengths_;
  std::map<std::string, PrivateGlass> private_indices_;
};

}  // namespace

LensDesign read_seq_with_problems(std::string_view bytes, const std::string& file, int configuration) {
  return SeqReader(bytes, file, configuration).read();
}

LensDesign read_seq(std::string_view bytes, const std::string& file) {
  LensDesign design = read_seq_with_problems(bytes, file);
  throw_if_any(design.problems);
  return design;
}

}  // namespace relign::lens_files
