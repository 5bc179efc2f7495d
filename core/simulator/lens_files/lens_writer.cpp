#include "lens_files/lens_writer.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

using optics::Motion;

constexpr double kNothing = 1e-9;  // mm, and relative in rotations: rounding of a motion and its inverse

double degrees(double radians) { return radians * 57.29577951308232; }
// Rounds, so that files do not contain 3.0000000000000004.
double tidy(double value) {
  const double rounded = std::round(value * 1e10) / 1e10;
  return rounded == 0 ? 0 : rounded;
}

bool straight(const Motion& motion) {
  return std::fabs(motion.rotation[2]) < kNothing && std::fabs(motion.rotation[5]) < kNothing && motion.rotation[8] > 0;
}
bool on_axis(const Motion& motion) {
  return std::fabs(motion.translation.x) < kNothing && std::fabs(motion.translation.y) < kNothing;
}

class Writer {
 public:
  Writer(LensDesign& design, const GlassSources& sources, double wavelength_nm)
      : design_(design), wavelength_nm_(wavelength_nm), glasses_(design, sources, wavelength_nm) {}

  LensDraft write(const std::string& name) {
    check_surfaces();
    throw_problems();
    place_surfaces();
    throw_problems();
    group();
    place_stop();
    for (const Problem& problem : glasses_.problems()) problems_.push_back(problem);
    throw_in_order();
    place_image();
    draft_.name = name;
    draft_.source = (design_.title.empty() ? "" : shown(design_.title, 200) + "; ") + "from " +
                    design_.file.substr(design_.file.find_last_of('/') + 1) + " (" + design_.format + ")";
    draft_.wavelength_nm = wavelength_nm_;
    draft_.glasses = glasses_.own_glasses();
    return std::move(draft_);
  }

 private:
  void problem(const Surface& surface, const std::string& message) {
    problems_.push_back({design_.file, surface.line, 0, "", message});
  }

  // Throws all problems of surfaces, together with those of glasses, which group() has not processed yet.
  void throw_problems() {
    if (problems_.empty()) return;
    for (const Surface& surface : design_.surfaces)
      if (!surface.glass.empty()) glasses_.of(surface);
    for (const Problem& problem : glasses_.problems()) problems_.push_back(problem);
    throw_in_order();
  }
  void throw_in_order() {
    std::stable_sort(problems_.begin(), problems_.end(),
                     [](const Problem& a, const Problem& b) { return a.line < b.line; });
    throw_if_any(problems_);
  }

  void check_surfaces() {
    constexpr double kShortest_nm = 100, kLongest_nm = 1e5;
    problems_ = design_.problems;
    // A wavelength that could not be read is among the design's problems.
    if (!(wavelength_nm_ >= kShortest_nm && wavelength_nm_ <= kLongest_nm) && design_.problems.empty())
      problems_.push_back(
          {design_.file, 0, 0, "", "expected a wavelength from 100 to 100000 nm, found " + shortest(wavelength_nm_)});
    if (design_.surfaces.size() < (has_mirrors() ? 3 : 4)) {
      problems_.push_back({design_.file, 0, 0, "",
                           "found only " + counted(design_.surfaces.size(), "surface") +
                               "; a lens needs at least an object, two faces or a mirror, and an image"});
      return;
    }
    if (medium(0) != nullptr)
      problem(design_.surfaces[0], "the object is inside glass; only lenses in air are supported");
    add_missing_image();
    if (const Surface* glass = medium(design_.surfaces.size() - 2)) {
      const std::string last = design_.surfaces.back().label;
      problem(*glass, "the image is inside the glass behind surface " + glass->label + ", which extends to surface " +
                          last + ", the last one; if " + last +
                          " is the back of a plate, add the image surface and the distance to it; if the plate is "
                          "cemented to the sensor, remove it, since the lens moves and the sensor does not");
    }
    std::size_t stops = 0;
    for (std::size_t i = 1; i < design_.surfaces.size(); ++i) {
      Surface& surface = design_.surfaces[i];
      stops += surface.stop ? 1 : 0;
      if (i + 1 < design_.surfaces.size() && std::fabs(surface.thickness_mm) >= kInfinite)
        problem(surface, "surface " + surface.label + " is at infinite distance from the next one");
      if (surface.clear_radius_mm < 0) problem(surface, "surface " + surface.label + ": negative semi-diameter");
      tidy_asphere(surface);
    }
    if (const Surface& last = design_.surfaces.back(); last.stop)
      problem(last,
              "surface " + last.label +
                  ", the last one and therefore the image, is marked as the stop; check that the file is complete");
    if (stops != 1)
      problems_.push_back({design_.file, 0, 0, "",
                           "exactly one surface must be the stop, found " + std::to_string(stops) +
                               "; mark it (Zemax: STOP, CODE V: STO)"});
  }

  // Files made from patents often end with the back of the cover glass, whose distance leads to a missing image
  // surface. (In CODE V that distance is a defocus.)
  void add_missing_image() {
    const Surface last = design_.surfaces.back();
    const bool plane = last.curvature == 0 && last.even_asphere.empty() && last.odd_asphere.empty();
    if (design_.format != "Zemax" || medium(design_.surfaces.size() - 2) == nullptr || !plane ||
        !(last.thickness_mm > 0 && last.thickness_mm < kInfinite))
      return;
    Surface image;
    image.line = last.line;
    image.label = std::to_string(design_.surfaces.size());
    design_.surfaces.push_back(image);
    design_.remarks.push_back(
        {last.line,
         "assumed: a missing image surface, " + significant(last.thickness_mm, 6) + " mm behind surface " + last.label +
             "; the file ends with glass in front of surface " + last.label + ", which states a further distance",
         0});
  }

  // A plane or paraboloid with a term of r^2 becomes a paraboloid; on any other face the term is kept.
  void tidy_asphere(Surface& surface) {
    std::vector<double>& terms = surface.even_asphere;
    if (!terms.empty() && terms[0] != 0 && (surface.curvature == 0 || surface.conic == -1)) {
      surface.curvature += 2 * terms[0];
      surface.conic = -1;
      terms[0] = 0;
    }
    for (std::vector<double>* list : {&terms, &surface.odd_asphere})
      while (!list->empty() && list->back() == 0) list->pop_back();
    const bool polynomial = !terms.empty() || !surface.odd_asphere.empty();
    if ((surface.q_bfs || surface.q_con) && (polynomial || (surface.q_bfs && surface.q_con)))
      problem(surface, "surface " + surface.label + " mixes Q-type terms with others; use one kind of terms");
  }

  bool has_mirrors() const {
    return std::any_of(design_.surfaces.begin(), design_.surfaces.end(),
                       [](const Surface& surface) { return surface.mirror; });
  }

  // The surface whose glass follows surface i, null in air.
  const Surface* medium(std::size_t i) const {
    while (i > 0 && (design_.surfaces[i].break_only || design_.surfaces[i].mirror)) --i;
    const Surface& surface = design_.surfaces[i];
    return surface.glass.empty() && surface.nd == 0 && surface.index == 0 ? nullptr : &surface;
  }
  static bool same_glass(const Surface* a, const Surface* b) {
    if (a == nullptr || b == nullptr) return a == b;
    return a->glass == b->glass && a->nd == b->nd && a->vd == b->vd && a->index == b->index;
  }

  void place_surfaces() {
    frames_.assign(design_.surfaces.size(), Motion());
    Motion frame;
    for (std::size_t i = 1; i < design_.surfaces.size(); ++i) {
      const Surface& surface = design_.surfaces[i];
      if (surface.before) frame = after(frame, *surface.before);
      frames_[i] = frame;
      if (surface.after) frame = after(frame, *surface.after);
      frame = after(frame, Motion{optics::kIdentityRotation, {0, 0, surface.thickness_mm}});
    }
    if (!straight(frames_.back()) || !on_axis(frames_.back()))
      problem(design_.surfaces.back(),
              "coordinate breaks leave the image tilted or off the axis; they must return to the axis (in pairs around "
              "an element; CODE V: DAR)");
  }

  void group() {
    const Motion* front = nullptr;        // of the element under way
    std::size_t lenses = 0, mirrors = 0;  // mirrors in air
    for (std::size_t i = 1; i + 1 < design_.surfaces.size(); ++i) {
      const Surface& surface = design_.surfaces[i];
      const Surface *before = medium(i - 1), *behind = medium(i);
      if (surface.break_only || (!surface.mirror && same_glass(before, behind))) continue;
      if (surface.mirror) {
        direction_ = -direction_;
        if (!straight(frames_[i]) || !on_axis(frames_[i]))
          problem(surface, "surface " + surface.label +
                               " is a mirror that is tilted or off the axis; supported are mirrors on the axis");
      }
      if (before == nullptr) {
        front = &frames_[i];
        if (draft_.elements.empty()) design_.first_vertex_mm = first_z_ = front->translation.z;
        const std::string name = surface.mirror ? "M" + std::to_string(++mirrors) : "L" + std::to_string(++lenses);
        draft_.elements.push_back({name, placement_of(surface, *front), {}});
      }
      draft_.elements.back().faces.push_back(face_of(i, *front, behind));
      last_z_ = draft_.elements.back().faces.back().z_mm;
    }
    if (draft_.elements.empty()) {
      problems_.push_back({design_.file, 0, 0, "", "no lens found: no surface is followed by glass"});
      return;
    }
    const double image_z = frames_.back().translation.z - first_z_;
    if (has_mirrors() && direction_ * (image_z - last_z_) < -kNothing)
      problem(design_.surfaces.back(),
              "the image is in front of the last face, along the light; distances behind an odd number of mirrors are "
              "negative");
  }

  DraftFace face_of(std::size_t i, const Motion& front, const Surface* behind) {
    const Surface& surface = design_.surfaces[i];
    const Motion within = after(optics::inverse(front), frames_[i]);
    if (!straight(within) || !on_axis(within))
      problem(surface, "surface " + surface.label +
                           " is tilted or decentred relative to the front of its own element; elements must be "
                           "bodies of revolution");
    DraftFace face;
    face.surface = i;
    face.z_mm = tidy(front.translation.z - first_z_ + within.translation.z);
    face.radius_mm = radius_of(surface);
    if (!surface.mirror && behind != nullptr) face.behind = glasses_.of(*behind);
    face.semi_diameter_mm = stated(surface);
    return face;
  }

  // p_lens = front vertex + Rx Ry (p - front vertex) + shift. A rotation about the element's own axis has no effect.
  std::optional<DraftPlacement> placement_of(const Surface& surface, const Motion& front) {
    if (straight(front) && on_axis(front)) return std::nullopt;
    if (front.rotation[8] <= 0) {
      problem(surface, "surface " + surface.label + " is tilted by 90 degrees or more");
      return std::nullopt;
    }
    const double rx = degrees(std::atan2(-front.rotation[5], front.rotation[8]));
    const double ry = degrees(std::asin(std::clamp(front.rotation[2], -1.0, 1.0)));
    return DraftPlacement{tidy(rx), tidy(ry), tidy(front.translation.x), tidy(front.translation.y)};
  }

  // The stop has a place in the surface order if its position on the axis does not imply it: on a face, inside glass,
  // or in front of a vertex that comes earlier in the file.
  void place_stop() {
    const auto found = std::find_if(design_.surfaces.begin() + 1, design_.surfaces.end(),
                                    [](const Surface& surface) { return surface.stop; });
    DraftStop& stop = draft_.stop;
    stop.surface = static_cast<std::size_t>(found - design_.surfaces.begin());
    const Motion& frame = frames_[stop.surface];
    if (!straight(frame) || !on_axis(frame))
      problem(*found, "the stop (surface " + found->label + ") is tilted or off the axis; stops must be on the axis");
    stop.z_mm = tidy(frame.translation.z - first_z_);
    std::size_t before = 0;  // faces that light passes before the stop
    bool in_glass = false, in_order = true;
    for (const DraftElement& element : draft_.elements)
      for (const DraftFace& face : element.faces) {
        const bool passed = face.surface < stop.surface;
        stop.on_face = stop.on_face || face.surface == stop.surface;
        before += passed ? 1 : 0;
        in_glass = passed ? &face != &element.faces.back() : in_glass;
        in_order =
            in_order && (passed ? face.z_mm <= stop.z_mm : face.surface == stop.surface || face.z_mm >= stop.z_mm);
      }
    if (stop.on_face || in_glass || !in_order || has_mirrors()) stop.before_face = before;
  }

  void place_image() {
    // CODE V writes a defocus as the image's thickness.
    double z = frames_.back().translation.z - first_z_;
    if (design_.format != "Zemax" && std::fabs(design_.surfaces.back().thickness_mm) < kInfinite)
      z += design_.surfaces.back().thickness_mm;
    draft_.image_stated = direction_ * (z - last_z_) > kNothing;
    draft_.image_z_mm = draft_.image_stated ? tidy(z) : last_z_ + direction_;
  }

  // Curvatures in files usually come from a radius: the nearest of 13 digits if it gives the same curvature.
  static std::optional<double> radius_of(const Surface& surface) {
    constexpr int kDigits = 13;
    constexpr double kFlat = 1e-9;  // 1/mm: lens files take radii up to 1e9 mm
    if (!(std::fabs(surface.curvature) > kFlat)) return std::nullopt;
    const double radius = 1 / surface.curvature, nearest = rounded(radius, kDigits);
    return std::fabs(nearest * surface.curvature - 1) < 1e-14 ? nearest : radius;
  }

  static std::optional<double> stated(const Surface& surface) {
    const double radius = tidy(surface.clear_radius_mm);
    return radius > 0 ? std::optional<double>(radius) : std::nullopt;
  }

  LensDesign& design_;
  double wavelength_nm_;
  GlassChoice glasses_;
  std::vector<Problem> problems_;
  LensDraft draft_;
  std::vector<Motion> frames_;
  double first_z_ = 0, last_z_ = 0;
  double direction_ = 1;  // of the light behind the last face: +-z
};

OrderedJson face_json(const DraftFace& face, const Surface& surface) {
  OrderedJson json = {{"z_mm", face.z_mm}, {"radius_mm", nullptr}};
  if (face.radius_mm) json["radius_mm"] = *face.radius_mm;
  if (surface.conic != 0) json["conic"] = surface.conic;
  const std::vector<double>& even = surface.even_asphere;
  if (!even.empty() && even[0] != 0) json["r2"] = even[0];
  if (even.size() > 1) json["even_asphere"] = std::vector<double>(even.begin() + 1, even.end());
  if (!surface.odd_asphere.empty()) json["odd_asphere"] = surface.odd_asphere;
  const auto write = [&](const char* key, const std::optional<QAsphere>& asphere) {
    if (asphere) json[key] = {{"radius_mm", asphere->radius_mm}, {"coefficients", asphere->coefficients}};
  };
  write("q_bfs", surface.q_bfs);
  write("q_con", surface.q_con);
  if (surface.mirror) json["mirror"] = true;
  if (face.behind.index > 0) json["index_after"] = face.behind.index;
  if (!face.behind.name.empty()) json["glass_after"] = face.behind.name;
  json["clear_radius_mm"] = face.semi_diameter_mm.value_or(kProvisional_mm);
  return json;
}

OrderedJson stop_json(const DraftStop& stop) {
  OrderedJson json = {{"name", "aperture stop"},
                      {"z_mm", stop.z_mm},
                      {"opening_radius_mm", stop.opening_radius_mm.value_or(kProvisional_mm)},
                      {"in_listing", true},
                      {"aperture", true}};
  if (stop.before_face) json[stop.on_face ? "on_face" : "before_face"] = *stop.before_face + 1;
  return json;
}

// Scenes have one wavelength unless polychromatic: notes that the file's others are not used.
void remark_unused_wavelengths(LensDesign& design, double wavelength_nm) {
  std::vector<std::string> others;
  for (const double other : design.all_wavelengths_nm) {
    const std::string text = shortest(rounded(other, 9));
    if (std::fabs(other - wavelength_nm) > 1e-6 * wavelength_nm &&
        std::find(others.begin(), others.end(), text) == others.end())
      others.push_back(text);
  }
  if (others.empty()) return;
  std::string text;
  for (const std::string& other : others) text += (text.empty() ? "" : ", ") + other;
  const bool the_files = std::fabs(design.wavelength_nm - wavelength_nm) <= 1e-6 * wavelength_nm;
  design.remarks.push_back({design.wavelengths_line,
                            "not used: the wavelength" + std::string(others.size() > 1 ? "s " : " ") + text +
                                " nm; images use one, " + shortest(rounded(wavelength_nm, 9)) + " nm, " +
                                (the_files ? "the file's reference (--wavelength selects another, scene new "
                                             "--polychromatic all of them)"
                                           : "from --wavelength"),
                            0});
}

}  // namespace

LensDraft draft_lens(LensDesign& design, const GlassSources& sources, const std::string& name, double wavelength_nm,
                     bool polychromatic) {
  if (!polychromatic) remark_unused_wavelengths(design, wavelength_nm > 0 ? wavelength_nm : design.wavelength_nm);
  return Writer(design, sources, wavelength_nm > 0 ? wavelength_nm : design.wavelength_nm).write(name);
}

OrderedJson lens_json(const LensDraft& draft, const LensDesign& design) {
  OrderedJson lens = {{"format", 1},
                      {"name", draft.name},
                      {"source", draft.source},
                      {"wavelength_nm", draft.wavelength_nm},
                      {"half_field_deg", draft.half_field_deg},
                      {"pivot_z_mm", 0},
                      {"image_z_mm", draft.image_z_mm}};
  if (!draft.glasses.empty()) lens["glasses"] = draft.glasses;
  for (const DraftElement& element : draft.elements) {
    OrderedJson json = {{"name", element.name}};
    if (const auto& placement = element.placement)
      json["placement"] = {{"tilt_deg", {placement->tilt_x_deg, placement->tilt_y_deg}},
                           {"shift_mm", {placement->shift_x_mm, placement->shift_y_mm, 0}}};
    for (const DraftFace& face : element.faces) json["faces"].push_back(face_json(face, design.surfaces[face.surface]));
    lens["elements"].push_back(std::move(json));
  }
  lens["stops"] = OrderedJson::array({stop_json(draft.stop)});
  if (!design.published.empty()) lens["published"] = design.published;
  if (draft.entrance_pupil_diameter_mm) lens["entrance_pupil_diameter_mm"] = *draft.entrance_pupil_diameter_mm;
  return lens;
}

}  // namespace relign::lens_files
