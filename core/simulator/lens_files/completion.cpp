#include "lens_files/completion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

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

class Completion {
 public:
  Completion(LensDesign& design, LensDraft draft) : design_(design), draft_(std::move(draft)) {
    for (DraftElement& element : draft_.elements)
      for (DraftFace& face : element.faces) faces_.push_back(&face);
    for (const DraftFace* face : faces_) is_stated_.push_back(face->semi_diameter_mm.has_value());
    trimmed_.assign(faces_.size(), false);
  }
  Completion(const Completion&) = delete;

  CompleteLens run() {
    if (std::any_of(faces_.begin(), faces_.end(), [&](const DraftFace* face) { return surface_of(*face).mirror; }))
      assume(
          "assumed: no obstruction between mirrors; rays pass the surfaces in the order of the file, and neither "
          "a secondary mirror nor the hole of a primary blocks any");
    keep_faces_apart();
    set_image();
    set_field();
    set_aperture();
    limit_field();
    if (std::find(is_stated_.begin(), is_stated_.end(), false) != is_stated_.end()) set_semi_diameters();
    check_stop();
    check_axial_beam();
    remark_plane_plates();
    return {lens_json(draft_, design_), read_lens(), opening_reason_};
  }

 private:
  void assume(const std::string& text) { remark(0, text); }
  void remark(int line, const std::string& text) { design_.remarks.push_back({line, text, 0}); }
  [[noreturn]] void refuse(int line, const std::string& message) const {
    throw ProblemsError({{design_.file, line, 0, "", message}});
  }

  const Surface& surface_of(const DraftFace& face) const { return design_.surfaces[face.surface]; }
  const Surface& stop_surface() const { return design_.surfaces[draft_.stop.surface]; }

  // As a reader of lens.json has it. Mistakes are reported at the surfaces of the design.
  optics::Prescription read_lens() const {
    try {
      return optics::read_prescription(JsonSource::from_value(lens_json(draft_, design_), design_.file));
    } catch (const ProblemsError& error) {
      throw ProblemsError(at_surfaces(error.problems()));
    }
  }

  std::vector<Problem> at_surfaces(std::vector<Problem> problems) const {
    std::map<std::string, std::size_t> surface_at = {{"/stops/0", draft_.stop.surface},
                                                     {"/image_z_mm", design_.surfaces.size() - 1}};
    for (std::size_t e = 0; e < draft_.elements.size(); ++e) {
      const std::string element = "/elements/" + std::to_string(e);
      const std::vector<DraftFace>& faces = draft_.elements[e].faces;
      surface_at[element] = faces.front().surface;
      for (std::size_t f = 0; f < faces.size(); ++f)
        surface_at[element + "/faces/" + std::to_string(f)] = faces[f].surface;
    }
    for (Problem& problem : problems) {
      std::string place = problem.pointer;  // of a member: its face or stop
      while (!place.empty() && surface_at.count(place) == 0) place.resize(place.rfind('/'));
      if (place.empty()) continue;
      const Surface& surface = design_.surfaces[surface_at.at(place)];
      problem = {design_.file, surface.line, 0, "", "surface " + surface.label + ": " + problem.message};
    }
    return problems;
  }

  void keep_faces_apart() {
    std::vector<std::optional<double>> stated;
    for (DraftFace* face : faces_) stated.push_back(std::exchange(face->semi_diameter_mm, std::nullopt));
    const std::vector<std::string> reasons = trim_semi_diameters(read_lens(), stated);
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      faces_[i]->semi_diameter_mm = stated[i];
      trimmed_[i] = !reasons[i].empty();
      const Surface& surface = surface_of(*faces_[i]);
      if (trimmed_[i])
        remark(surface.line, "the semi-diameter of surface " + surface.label + ", " +
                                 significant(surface.clear_radius_mm, 6) + " mm, " + reasons[i] + ": trimmed to " +
                                 significant(*stated[i], 6) + " mm");
    }
  }

  // Fields are laid out by chief rays: reduces the field to the largest one that has a chief ray.
  void limit_field() {
    const double wanted_deg = draft_.half_field_deg;
    const auto field_deg = largest_field(read_lens(), wanted_deg, design_.beam_distance_mm());
    if (!field_deg || *field_deg == wanted_deg) return;
    draft_.half_field_deg = std::floor(*field_deg * 1e6) / 1e6;
    remark(design_.field.line, "no chief ray passes at the file's half field of " + shortest(wanted_deg) +
                                   " degrees; reduced to the largest at which one does, " + significant(*field_deg, 4) +
                                   " degrees");
  }

  void set_image() {
    if (draft_.image_stated) return;
    const optics::FirstOrder data = optics::first_order(read_lens());
    // Behind an odd number of mirrors light travels towards -z.
    const double along_light = data.back_focal_length * (draft_.image_z_mm < data.overall_length ? -1 : 1);
    if (!(along_light > 0) || along_light > 1e5)
      refuse(0, "the file states no distance to the image, and the lens has no focus behind its last face");
    draft_.image_z_mm = data.overall_length + data.back_focal_length;
    assume("assumed: the image plane at the paraxial focus, " + significant(data.back_focal_length, 6) +
           " mm behind the last face; the file states no distance");
  }

  void set_field() {
    constexpr double kWidest_deg = 89, kAssumed_deg = 10;
    const optics::FirstOrder data = optics::first_order(read_lens());
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
      const auto real = field_of_real_height(design_, read_lens(), field.value, paraxial);
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
      remark(field.line, "not used: the half field beyond " + shortest(kWidest_deg) + " degrees, of " +
                             shortest(half_deg) + "; targets are flat and in front of the lens");
      half_deg = kWidest_deg;
    }
    draft_.half_field_deg = std::round(half_deg * 1e6) / 1e6;
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
    std::optional<double>& opening_mm = draft_.stop.opening_radius_mm;
    const double own = stop_surface().clear_radius_mm;
    const optics::FirstOrder data = optics::first_order(read_lens());
    const double pupil_mm = stated_pupil(data);
    const double pupil_per_opening = std::fabs(data.entrance_pupil_diameter) / kProvisional_mm;
    double opening = pupil_mm > 0 ? pupil_mm / pupil_per_opening : own;
    // On a curved face the real marginal ray determines the opening, since rays hit the face and not the plane of its
    // vertex.
    if (pupil_mm > 0 && draft_.stop.on_face) opening = marginal_height(pupil_mm / 2).value_or(opening);
    if (!(opening >= kProvisional_mm && opening < 1e6))
      refuse(stop_surface().line,
             "the file states neither the opening of the stop nor a system aperture; add one of "
             "them (Zemax: ENPD or FNUM, CODE V: EPD or FNO)");
    opening_mm = std::round(opening * 1e9) / 1e9;
    for (DraftFace* face : faces_)  // a face that is the stop is at least as wide as the opening
      if (face->surface == draft_.stop.surface)
        face->semi_diameter_mm = std::max(*opening_mm, face->semi_diameter_mm.value_or(0));
    if (!(pupil_mm > 0)) {
      opening_reason_ =
          "radius; the stop surface's own, since " +
          (design_.aperture.kind == SystemAperture::stop_size
               ? design_.aperture.word + " selects it (line " + std::to_string(design_.aperture.line) + ")"
               : "the file states no system aperture");
      return;
    }
    draft_.entrance_pupil_diameter_mm = pupil_mm;
    opening_reason_ = "radius; from " + stated_with_line();
    if (own <= 0 || std::fabs(opening - own) <= kDiffers * own) return;
    const auto f_number = [&](double radius) {
      return "f/" + significant(std::fabs(data.focal_length) / (pupil_mm * radius / opening), 3);
    };
    opening_reason_ += ", not " + significant(own, 6) + " mm of the stop surface";
    remark(stop_surface().line, "not used: the semi-diameter of the stop, surface " + stop_surface().label + ", " +
                                    significant(own, 4) + " mm (" + f_number(own) + "), " +
                                    (own < opening ? "narrower" : "wider") + " than " + stated_with_line() +
                                    " requires, which opens the stop to " + significant(opening, 4) + " mm (" +
                                    f_number(opening) + "); to use the semi-diameter, " +
                                    (design_.format == "Zemax" ? "write FLOA instead of " + design_.aperture.word
                                                               : "remove the line " + design_.aperture.word));
  }

  // The height of the axial ray from the rim of the entrance pupil on the face that is the stop.
  std::optional<double> marginal_height(double pupil_radius_mm) const {
    const optics::Prescription lens = read_lens();
    const double object_mm = design_.beam_distance_mm();
    optics::Ray ray{{0, pupil_radius_mm, -1 - pupil_radius_mm}, {0, 0, 1}};
    if (object_mm > 0)
      ray = {{0, 0, -object_mm}, {0, pupil_radius_mm, optics::first_order(lens).entrance_pupil_z + object_mm}};
    const optics::TracedRay traced = optics::trace(optics::Assembly(lens), ray, optics::Apertures::none);
    const std::size_t face = *lens.aperture_stop().before_face;
    if (traced.hits.size() <= face) return std::nullopt;
    return std::hypot(traced.hits[face].x, traced.hits[face].y);
  }

  // As wide as the rays of all fields through the stop need, plus a margin unless faces would then cross.
  void set_semi_diameters() {
    constexpr double kMargin = 1.03, kLargestPartOfSphere = 0.98;
    const std::vector<double> needed = needed_radii(design_, read_lens());
    for (std::size_t i = 0; i < needed.size(); ++i)
      if (!is_stated_[i] && needed[i] < kProvisional_mm)
        refuse(0, "no ray of the field passes the stop and reaches the image");
    std::vector<double> least;  // a face that is the stop is open as wide as the stop
    for (const DraftFace* face : faces_) least.push_back(face->semi_diameter_mm.value_or(kProvisional_mm));
    double margin = kMargin;
    const auto set = [&](double chosen) {
      margin = chosen;
      for (std::size_t i = 0; i < needed.size(); ++i) {
        const double most = kLargestPartOfSphere * std::fabs(faces_[i]->radius_mm.value_or(1e6));
        const double radius = std::round(std::min(margin * needed[i], most) * 1e6) / 1e6;
        if (!is_stated_[i]) faces_[i]->semi_diameter_mm = std::max(least[i], radius);
      }
    };
    set(kMargin);
    for (const double smaller : {1.02, 1.01, 1.005, 1.0})
      if (!is_valid()) set(smaller);
    if (!is_valid()) set(kMargin);  // its mistakes are reported
    assume("assumed: semi-diameters of faces for which the file states none, " +
           shortest(std::round(1000 * (margin - 1)) / 10) + " % larger than the rays of the field need" +
           (margin < kMargin ? "; with a larger margin, faces would cross" : ""));
  }

  bool is_valid() const {
    try {
      read_lens();
      return true;
    } catch (const Error&) {
      return false;
    }
  }

  void check_stop() {
    const double opening = *draft_.stop.opening_radius_mm;
    double widest = 0;
    for (const DraftFace* face : faces_) widest = std::max(widest, *face->semi_diameter_mm);
    if (opening <= widest) return;
    const bool stated_aperture = draft_.entrance_pupil_diameter_mm.has_value();
    refuse(stated_aperture ? design_.aperture.line : stop_surface().line,
           (stated_aperture ? stated() + " opens the stop" : "the stop opens") + std::string(" to a radius of ") +
               significant(opening, 6) + " mm, wider than every face of the lens (" + significant(widest, 6) + " mm)");
  }

  // Finds semi-diameters of the file that block light within its own system aperture.
  void check_axial_beam() {
    constexpr double kPrintedRounding = 0.99;  // files print semi-diameters of the axial beam with few digits
    const optics::Prescription lens = read_lens();
    std::vector<double> needed(faces_.size(), 0);
    for (const FanRay& ray : beam(lens, 0, design_.beam_distance_mm()))
      for (std::size_t i = 0; i < needed.size(); ++i) needed[i] = std::max(needed[i], std::fabs(ray.traced.hits[i].y));
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const double radius = *faces_[i]->semi_diameter_mm;
      if (!is_stated_[i] || radius >= kPrintedRounding * needed[i]) continue;
      const Surface& surface = surface_of(*faces_[i]);
      if (trimmed_[i])
        refuse(surface.line, "surface " + surface.label + " crosses its neighbour within the axial beam, " +
                                 significant(radius, 4) + " mm from the axis of the " + significant(needed[i], 4) +
                                 " mm that the aperture needs; such a lens cannot be made");
      remark(surface.line, "the semi-diameter of surface " + surface.label + ", " + significant(radius, 4) +
                               " mm, blocks light on the axis: the beam through the stop needs " +
                               significant(needed[i], 4) + " mm there, so that f/" +
                               significant(optics::first_order(lens).f_number, 3) + " is not reached");
    }
  }

  bool is_plane(const DraftFace& face) const {
    const Surface& surface = surface_of(face);
    return !face.radius_mm && !surface.mirror && surface.even_asphere.empty() && surface.odd_asphere.empty() &&
           !surface.q_bfs && !surface.q_con;
  }

  // Cover glasses and filters are usually fixed to the sensor; here all glass moves with the lens.
  void remark_plane_plates() {
    for (std::size_t e = draft_.elements.size(); e-- > 1;) {
      const auto& [name, placement, faces] = draft_.elements[e];
      if (!std::all_of(faces.begin(), faces.end(), [&](const DraftFace& face) { return is_plane(face); })) return;
      const Surface &first = surface_of(faces.front()), &last = surface_of(faces.back());
      remark(first.line, "surfaces " + first.label + "-" + last.label + " (" + name +
                             ") are a plane plate in front of the image: it moves with the lens here and has "
                             "tolerances like an element; if it is fixed to the sensor (cover glass, filter), remove " +
                             name + " from tolerances.json: shifts of a plate change nothing, tilts little");
    }
  }

  LensDesign& design_;
  LensDraft draft_;
  std::vector<DraftFace*> faces_;          // of the draft, from the front
  std::vector<bool> is_stated_, trimmed_;  // their semi-diameters
  std::string opening_reason_;
};

// File names and titles may contain invalid UTF-8.
std::string dumped(const OrderedJson& value) {
  return value.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string pretty_value(const OrderedJson& value, const std::string& indent) {
  constexpr std::size_t kLine = 110;
  const std::string one_line = dumped(value);
  if (!value.is_structured() || value.empty()) return one_line;
  const bool list = value.is_array();
  bool flat = indent.size() + one_line.size() < kLine;
  std::vector<std::string> entries;
  for (const auto& [key, entry] : value.items()) {
    flat = flat && !entry.is_structured();
    entries.push_back((list ? "" : dumped(key) + ": ") + pretty_value(entry, indent + "  "));
  }
  const std::string end = flat ? "" : "\n" + indent;
  return (list ? "[" : "{") + (flat ? join(entries, ", ") : end + "  " + join(entries, "," + end + "  ")) + end +
         (list ? "]" : "}");
}

}  // namespace

CompleteLens complete_lens(LensDesign& design, LensDraft draft) { return Completion(design, std::move(draft)).run(); }

std::string pretty(const OrderedJson& json) { return pretty_value(json, "") + "\n"; }

}  // namespace relign::lens_files
