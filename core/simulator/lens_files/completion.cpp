#include "lens_files/completion.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/json_source.h"
#include "base/text.h"
#include "lens_files/axial_rays.h"
#include "lens_files/face_room.h"
#include "lens_files/field_beams.h"
#include "lens_files/text_lines.h"
#include "optics/first_order.h"
#include "optics/trace.h"

namespace relign::lens_files {
namespace {

constexpr double kProvisional_mm = 1e-6;  // smallest semi-diameter and opening that a lens file may have

std::string text_of(const LensDesign& design) { return design.file + " as lens.json"; }

// Translates mistakes found by the lens reader to surfaces and lines of the user's file.
std::string translated(const std::string& errors, const LensDraft& draft, const LensDesign& design) {
  std::string result;
  for (std::size_t begin = 0; begin < errors.size();) {
    const std::size_t end = std::min(errors.find('\n', begin), errors.size());
    std::string line = errors.substr(begin, end - begin);
    begin = end + 1;
    // The longest pointer of the draft in the line.
    std::size_t at = std::string::npos, longest = 0;
    std::size_t surface = 0;
    for (const auto& [pointer, index] : draft.surface_of)
      if (const std::size_t found = line.find(": " + pointer); found != std::string::npos && pointer.size() > longest) {
        at = found;
        longest = pointer.size();
        surface = index;
      }
    if (at != std::string::npos) {
      const std::size_t message = line.find(": ", at + 2);
      line = design.file + ":" + std::to_string(design.surfaces[surface].line) + ": surface " +
             design.surfaces[surface].label + line.substr(std::min(message, line.size()));
    }
    result += (result.empty() ? "" : "\n") + line;
  }
  return result;
}

optics::Prescription read_back(const LensDraft& draft, const LensDesign& design) {
  try {
    return optics::read_prescription(JsonSource::from_text(pretty(draft.json), text_of(design)));
  } catch (const Error& error) {
    throw Error(error.kind(), translated(error.what(), draft, design));
  }
}

template <class Body>
void each_face(OrderedJson& lens, Body&& body) {
  for (OrderedJson& element : lens["elements"])
    for (OrderedJson& face : element["faces"]) body(face);
}

class Completion {
 public:
  Completion(LensDesign& design, LensDraft draft) : design_(design), draft_(std::move(draft)) {}

  CompleteLens run() {
    draft_.json["stops"][0]["opening_radius_mm"] = kProvisional_mm;
    std::vector<bool> is_stated;
    bool mirrors = false;
    each_face(draft_.json, [&](OrderedJson& face) {
      mirrors = mirrors || face.contains("mirror");
      is_stated.push_back(face["clear_radius_mm"].get<double>() > 0);
      if (!is_stated.back()) face["clear_radius_mm"] = kProvisional_mm;
    });
    if (mirrors)
      assume(
          "assumed: no obstruction between mirrors; rays pass the surfaces in the order of the file, and neither "
          "a secondary mirror nor the hole of a primary blocks any");
    keep_faces_apart(is_stated);
    set_image();
    set_field();
    const bool all_stated = std::find(is_stated.begin(), is_stated.end(), false) == is_stated.end();
    set_aperture();
    limit_field();
    if (std::find(is_stated.begin(), is_stated.end(), false) != is_stated.end()) set_clear_radii(is_stated);
    if (!all_stated)
      assume("assumed: semi-diameters of faces for which the file states none, " + shortest(clear_margin_percent_) +
             " % larger than the rays of the field need" +
             (clear_margin_percent_ < 3 ? "; with a larger margin, faces would cross" : ""));
    check_stop();
    check_axial_beam(is_stated);
    remark_plane_plates();
    return {draft_.json, read_back(draft_, design_), opening_reason_};
  }

 private:
  void assume(const std::string& text) { design_.remarks.push_back({0, text, 0}); }
  [[noreturn]] void refuse(int line, const std::string& message) const {
    throw_if_any({{design_.file, line, 0, "", message}});
    throw Error(ErrorKind::internal, message);
  }

  void keep_faces_apart(const std::vector<bool>& is_stated) {
    LensDraft shapes = draft_;
    std::vector<double> stated;
    each_face(shapes.json, [&](OrderedJson& face) {
      stated.push_back(is_stated[stated.size()] ? face["clear_radius_mm"].get<double>() : 0);
      face["clear_radius_mm"] = kProvisional_mm;
    });
    const std::vector<Trim> trims = trim_clear_radii(read_back(shapes, design_), stated);
    trimmed_.assign(is_stated.size(), false);
    for (const Trim& trim : trims) trimmed_[trim.face] = true;
    each_surface([&](OrderedJson& face, std::size_t index, std::size_t i) {
      if (!trimmed_[i]) return;
      face["clear_radius_mm"] = stated[i];
      const auto last = std::find_if(trims.rbegin(), trims.rend(), [&](const Trim& trim) { return trim.face == i; });
      const Surface& surface = design_.surfaces[index];
      design_.remarks.push_back({surface.line,
                                 "the semi-diameter of surface " + surface.label + ", " +
                                     significant(surface.clear_radius_mm, 6) + " mm, " + last->reason +
                                     ": trimmed to " + significant(stated[i], 6) + " mm",
                                 0});
    });
  }

  // Fields are laid out by chief rays: reduces the field to the largest one that has a chief ray.
  void limit_field() {
    const optics::Prescription lens = read_back(draft_, design_);
    const auto field_deg = largest_field(lens, lens.half_field_deg, design_.beam_distance_mm());
    if (!field_deg || *field_deg == lens.half_field_deg) return;
    draft_.json["half_field_deg"] = std::floor(*field_deg * 1e6) / 1e6;
    design_.remarks.push_back({design_.field.line,
                               "no chief ray passes at the file's half field of " + shortest(lens.half_field_deg) +
                                   " degrees; reduced to the largest at which one does, " + significant(*field_deg, 4) +
                                   " degrees",
                               0});
  }

  void set_image() {
    if (draft_.image_stated) return;
    const optics::FirstOrder data = optics::first_order(read_back(draft_, design_));
    // Behind an odd number of mirrors light travels towards -z.
    const double along_light = data.back_focal_length * (draft_.json["image_z_mm"] < data.overall_length ? -1 : 1);
    if (!(along_light > 0) || along_light > 1e5)
      refuse(0, "the file states no distance to the image, and the lens has no focus behind its last face");
    const double z = data.overall_length + data.back_focal_length;
    draft_.json["image_z_mm"] = z;
    assume("assumed: the image plane at the paraxial focus, " + significant(data.back_focal_length, 6) +
           " mm behind the last face; the file states no distance");
  }

  void set_field() {
    constexpr double kWidest_deg = 89, kAssumed_deg = 10;
    const optics::FirstOrder data = optics::first_order(read_back(draft_, design_));
    const FieldSize& field = design_.field;
    double half_deg = field.value;
    const std::optional<double> object_mm = design_.object_distance_mm();
    const auto angle = [](double height, double distance) {
      return std::atan(height / std::fabs(distance)) * 57.29577951308232;
    };
    if (field.kind == FieldSize::object_height_mm) {
      if (!object_mm)
        refuse(field.line,
               "fields are object heights, but the object is at infinity; state field angles or an object distance");
      half_deg = angle(field.value, *object_mm + data.entrance_pupil_z);
    } else if (field.kind == FieldSize::image_height_mm) {
      half_deg = angle(field.value, data.focal_length);
    } else if (field.kind == FieldSize::real_image_height_mm) {
      const double paraxial = angle(field.value, data.focal_length);
      const auto real = field_of_real_height(design_, read_back(draft_, design_), field.value, paraxial);
      half_deg = real.value_or(paraxial);
      if (!real)
        assume("assumed: a half field of " + significant(paraxial, 4) +
               " degrees, the paraxial one; no chief ray reaches the real image height of " +
               significant(field.value, 4) + " mm");
    } else if (field.kind == FieldSize::none) {
      half_deg = kAssumed_deg;
      assume("assumed: a half field of 10 degrees; the file states no field off the axis");
    }
    half_deg = std::fabs(half_deg);
    if (half_deg >= 180 || !std::isfinite(half_deg))
      refuse(field.line, "expected a half field from 0 to 180 degrees, found " + shortest(half_deg));
    if (half_deg > kWidest_deg) {
      design_.remarks.push_back({field.line,
                                 "not used: the half field beyond " + shortest(kWidest_deg) + " degrees, of " +
                                     shortest(half_deg) + "; targets are flat and in front of the lens",
                                 0});
      half_deg = kWidest_deg;
    }
    draft_.json["half_field_deg"] = std::round(half_deg * 1e6) / 1e6;
  }

  // The diameter of the paraxial entrance pupil from the file's system aperture; 0 if it states none.
  double stated_pupil(const optics::FirstOrder& data) const {
    constexpr double kWidest_mm = 1e5, kNarrowest_mm = 1e-6;
    const SystemAperture& aperture = design_.aperture;
    const std::optional<double> object_mm = design_.object_distance_mm();
    double pupil_mm = 0;
    switch (aperture.kind) {
      case SystemAperture::entrance_pupil_diameter:
        pupil_mm = aperture.value;
        break;
      case SystemAperture::f_number:
        pupil_mm = std::fabs(data.focal_length) / aperture.value;
        break;
      case SystemAperture::image_na:
        pupil_mm = 2 * std::fabs(data.focal_length) * aperture.value;
        break;
      case SystemAperture::object_na:
        if (!object_mm)
          refuse(
              aperture.line,
              aperture.word + " is an aperture at the object, but the object is at infinity; state an object distance");
        if (aperture.value >= 1)
          refuse(aperture.line,
                 aperture.word + ": expected a numerical aperture below 1, found " + shortest(aperture.value));
        pupil_mm = 2 * std::fabs(*object_mm + data.entrance_pupil_z) * aperture.value /
                   std::sqrt(1 - aperture.value * aperture.value);
        break;
      case SystemAperture::stop_size:
      case SystemAperture::none:
        return 0;
    }
    if (!(pupil_mm >= kNarrowest_mm && pupil_mm <= kWidest_mm))
      refuse(aperture.line,
             stated() + " gives an entrance pupil of " + shortest(pupil_mm) + " mm; allowed are 1e-6 to 1e5 mm");
    return pupil_mm;
  }
  std::string stated() const {
    const SystemAperture& aperture = design_.aperture;  // in mm by now, whatever the file's unit
    return aperture.word + " " + shortest(aperture.value) +
           (aperture.kind == SystemAperture::entrance_pupil_diameter ? " mm" : "");
  }
  std::string stated_with_line() const { return stated() + " (line " + std::to_string(design_.aperture.line) + ")"; }

  // The system aperture determines the opening of the stop, as in design programs, which use the stop surface's own
  // semi-diameter only for drawing. The semi-diameter applies if no aperture is stated, or if the file selects it.
  void set_aperture() {
    constexpr double kDiffers = 0.01;
    OrderedJson& stop = draft_.json["stops"][0];
    const double own = stop_surface().clear_radius_mm;
    const optics::FirstOrder data = optics::first_order(read_back(draft_, design_));
    const double pupil_mm = stated_pupil(data);
    const double pupil_per_opening = std::fabs(data.entrance_pupil_diameter) / kProvisional_mm;
    double opening = pupil_mm > 0 ? pupil_mm / pupil_per_opening : own;
    // On a curved face the real marginal ray determines the opening, since rays hit the face and not the plane of its
    // vertex.
    if (pupil_mm > 0 && stop.contains("on_face")) opening = marginal_height(pupil_mm / 2).value_or(opening);
    if (!(opening >= kProvisional_mm && opening < 1e6))
      refuse(stop_surface().line,
             "the file states neither the opening of the stop nor a system aperture; add one of "
             "them (Zemax: ENPD or FNUM, CODE V: EPD or FNO)");
    stop["opening_radius_mm"] = std::round(opening * 1e9) / 1e9;
    open_face_of_stop(stop["opening_radius_mm"].get<double>());
    if (!(pupil_mm > 0)) {
      opening_reason_ =
          "radius; the stop surface's own, since " +
          (design_.aperture.kind == SystemAperture::stop_size
               ? design_.aperture.word + " selects it (line " + std::to_string(design_.aperture.line) + ")"
               : "the file states no system aperture");
      return;
    }
    draft_.json["entrance_pupil_diameter_mm"] = pupil_mm;
    opening_reason_ = "radius; from " + stated_with_line();
    if (own <= 0 || std::fabs(opening - own) <= kDiffers * own) return;
    const auto f_number = [&](double radius) {
      return "f/" + significant(std::fabs(data.focal_length) / (radius * pupil_per_opening), 3);
    };
    opening_reason_ += ", not " + significant(own, 6) + " mm of the stop surface";
    design_.remarks.push_back({stop_surface().line,
                               "not used: the semi-diameter of the stop, surface " + stop_surface().label + ", " +
                                   significant(own, 4) + " mm (" + f_number(own) + "), " +
                                   (own < opening ? "narrower" : "wider") + " than " + stated_with_line() +
                                   " requires, which opens the stop to " + significant(opening, 4) + " mm (" +
                                   f_number(opening) + "); to use the semi-diameter, " +
                                   (design_.format == "Zemax" ? "write FLOA instead of " + design_.aperture.word
                                                              : "remove the line " + design_.aperture.word),
                               0});
  }

  // The height of the axial ray from the rim of the entrance pupil on the face that is the stop.
  std::optional<double> marginal_height(double pupil_radius_mm) const {
    const optics::Prescription lens = read_back(draft_, design_);
    const double object_mm = design_.beam_distance_mm();
    optics::Ray ray{{0, pupil_radius_mm, -1 - pupil_radius_mm}, {0, 0, 1}};
    if (object_mm > 0)
      ray = {{0, 0, -object_mm}, {0, pupil_radius_mm, optics::first_order(lens).entrance_pupil_z + object_mm}};
    const optics::TracedRay traced = optics::trace(optics::Assembly(lens), ray, optics::Apertures::none);
    const std::size_t face = *lens.aperture_stop().before_face;
    if (traced.hits.size() <= face) return std::nullopt;
    return std::hypot(traced.hits[face].x, traced.hits[face].y);
  }

  // A face that is the stop is at least as wide as the opening.
  void open_face_of_stop(double opening) {
    each_surface([&](OrderedJson& face, std::size_t index, std::size_t) {
      if (index != draft_.surface_of.at("/stops/0") || face["clear_radius_mm"].get<double>() >= opening) return;
      face["clear_radius_mm"] = opening;
    });
  }

  // As wide as the rays of all fields through the stop need, plus a margin unless faces would then cross.
  void set_clear_radii(const std::vector<bool>& is_stated) {
    constexpr double kMargin = 1.03, kLargestPartOfSphere = 0.98;
    const std::vector<double> needed = needed_radii(design_, read_back(draft_, design_));
    for (std::size_t i = 0; i < needed.size(); ++i)
      if (!is_stated[i] && needed[i] < kProvisional_mm)
        refuse(0, "no ray of the field passes the stop and reaches the image");
    std::vector<double> least;  // a face that is the stop is open as wide as the stop
    each_face(draft_.json, [&](OrderedJson& face) { least.push_back(face["clear_radius_mm"].get<double>()); });
    const auto set = [&](double margin) {
      std::size_t i = 0;
      each_face(draft_.json, [&](OrderedJson& face) {
        const double radius = face["radius_mm"].is_null() ? 1e6 : std::fabs(face["radius_mm"].get<double>());
        const double clear = std::min(margin * needed[i], kLargestPartOfSphere * radius);
        if (!is_stated[i]) face["clear_radius_mm"] = std::max(least[i], std::round(clear * 1e6) / 1e6);
        ++i;
      });
    };
    for (const double margin : {kMargin, 1.02, 1.01, 1.005, 1.0}) {
      set(margin);
      try {
        read_back(draft_, design_);
        clear_margin_percent_ = std::round(1000 * (margin - 1)) / 10;
        return;
      } catch (const Error&) {  // reported with the largest margin if no smaller one helps
      }
    }
    set(kMargin);
  }

  void check_stop() {
    double widest = 0;
    each_face(draft_.json,
              [&](OrderedJson& face) { widest = std::max(widest, face["clear_radius_mm"].get<double>()); });
    const double opening = draft_.json["stops"][0]["opening_radius_mm"].get<double>();
    if (opening <= widest) return;
    const bool stated_aperture = draft_.json.contains("entrance_pupil_diameter_mm");
    refuse(stated_aperture ? design_.aperture.line : stop_surface().line,
           (stated_aperture ? stated() + " opens the stop" : "the stop opens") + std::string(" to a radius of ") +
               significant(opening, 6) + " mm, wider than every face of the lens (" + significant(widest, 6) + " mm)");
  }

  // Finds semi-diameters of the file that block light within its own system aperture.
  void check_axial_beam(const std::vector<bool>& is_stated) {
    constexpr double kPrintedRounding = 0.99;  // files print semi-diameters of the axial beam with few digits
    const optics::Prescription lens = read_back(draft_, design_);
    std::vector<double> needed(is_stated.size(), 0);
    for (const FanRay& ray : beam(lens, 0, design_.beam_distance_mm()))
      for (std::size_t i = 0; i < needed.size(); ++i) needed[i] = std::max(needed[i], std::fabs(ray.traced.hits[i].y));
    each_surface([&](const OrderedJson& face, std::size_t index, std::size_t i) {
      const double clear = face["clear_radius_mm"].get<double>();
      if (!is_stated[i] || clear >= kPrintedRounding * needed[i]) return;
      const Surface& surface = design_.surfaces[index];
      if (trimmed_[i])
        refuse(surface.line, "surface " + surface.label + " crosses its neighbour within the axial beam, " +
                                 significant(clear, 4) + " mm from the axis of the " + significant(needed[i], 4) +
                                 " mm that the aperture needs; such a lens cannot be made");
      design_.remarks.push_back({surface.line,
                                 "the semi-diameter of surface " + surface.label + ", " + significant(clear, 4) +
                                     " mm, blocks light on the axis: the beam through the stop needs " +
                                     significant(needed[i], 4) + " mm there, so that f/" +
                                     significant(optics::first_order(lens).f_number, 3) + " is not reached",
                                 0});
    });
  }

  // Cover glasses and filters are usually fixed to the sensor; here all glass moves with the lens.
  void remark_plane_plates() {
    const OrderedJson& elements = draft_.json["elements"];
    for (std::size_t e = elements.size(); e-- > 1;) {
      const OrderedJson& faces = elements[e]["faces"];
      const bool plate = std::all_of(faces.begin(), faces.end(), [](const OrderedJson& face) {
        const bool shaped = face.contains("mirror") || face.contains("even_asphere") || face.contains("odd_asphere") ||
                            face.contains("r2") || face.contains("q_bfs") || face.contains("q_con");
        return face["radius_mm"].is_null() && !shaped;
      });
      if (!plate) return;
      const std::string at = "/elements/" + std::to_string(e) + "/faces/", name = elements[e]["name"];
      const Surface& first = design_.surfaces[draft_.surface_of.at(at + "0")];
      const Surface& last = design_.surfaces[draft_.surface_of.at(at + std::to_string(faces.size() - 1))];
      design_.remarks.push_back(
          {first.line,
           "surfaces " + first.label + "-" + last.label + " (" + name +
               ") are a plane plate in front of the image: it moves with the lens here and has "
               "tolerances like an element; if it is fixed to the sensor (cover glass, filter), remove " +
               name + " from tolerances.json: shifts of a plate change nothing, tilts little",
           0});
    }
  }

  // Visits faces with their surface in the design, numbered from the front.
  template <class Body>
  void each_surface(Body&& body) {
    std::size_t i = 0;
    for (std::size_t e = 0; e < draft_.json["elements"].size(); ++e) {
      OrderedJson& faces = draft_.json["elements"][e]["faces"];
      for (std::size_t f = 0; f < faces.size(); ++f, ++i)
        body(faces[f], draft_.surface_of.at("/elements/" + std::to_string(e) + "/faces/" + std::to_string(f)), i);
    }
  }

  const Surface& stop_surface() const { return design_.surfaces[draft_.surface_of.at("/stops/0")]; }

  LensDesign& design_;
  LensDraft draft_;
  std::string opening_reason_;
  double clear_margin_percent_ = 3;
  std::vector<bool> trimmed_;  // which faces
};

// File names and titles may contain invalid UTF-8.
std::string dumped(const OrderedJson& value) {
  return value.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

bool all_numbers(const OrderedJson& value) {
  return std::all_of(value.begin(), value.end(), [](const OrderedJson& entry) { return !entry.is_structured(); });
}

void write_pretty(const OrderedJson& value, const std::string& indent, std::string& text) {
  constexpr std::size_t kLine = 110;
  if (value.is_structured() && !value.empty()) {
    const std::string one_line = dumped(value);
    const bool flat = all_numbers(value) && indent.size() + one_line.size() < kLine;
    if (!flat) {
      const std::string inner = indent + "  ";
      text += value.is_array() ? "[\n" : "{\n";
      std::size_t i = 0;
      for (const auto& [key, entry] : value.items()) {
        text += inner + (value.is_array() ? "" : dumped(key) + ": ");
        write_pretty(entry, inner, text);
        text += ++i < value.size() ? ",\n" : "\n";
      }
      text += indent + (value.is_array() ? "]" : "}");
      return;
    }
    // One line, with a space after every comma and colon outside strings.
    bool quoted = false;
    for (std::size_t i = 0; i < one_line.size(); ++i) {
      if (one_line[i] == '"' && (i == 0 || one_line[i - 1] != '\\')) quoted = !quoted;
      text += one_line[i];
      if (!quoted && (one_line[i] == ',' || one_line[i] == ':')) text += ' ';
    }
    return;
  }
  text += dumped(value);
}

}  // namespace

CompleteLens complete_lens(LensDesign& design, LensDraft draft) { return Completion(design, std::move(draft)).run(); }

std::string pretty(const OrderedJson& json) {
  std::string text;
  write_pretty(json, "", text);
  return text + "\n";
}

}  // namespace relign::lens_files
