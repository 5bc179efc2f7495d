#include "lens_files/lens_writer.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

using optics::Motion;

constexpr double kNothing = 1e-9;  // mm, and relative in rotations: rounding of a motion and its inverse
constexpr double kFlat = 1e-9;     // 1/mm: lens files take radii up to 1e9 mm

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
    LensDraft draft;
    OrderedJson elements = OrderedJson::array();
    group(elements, draft);
    OrderedJson stops = OrderedJson::array();
    write_stop(elements, stops, draft);
    for (const Problem& problem : glasses_.problems()) problems_.push_back(problem);
    throw_in_order();

    OrderedJson& lens = draft.json;
    lens["format"] = 1;
    lens["name"] = name;
    lens["source"] = (design_.title.empty() ? "" : shown(design_.title, 200) + "; ") + "from " +
                     design_.file.substr(design_.file.find_last_of('/') + 1) + " (" + design_.format + ")";
    lens["wavelength_nm"] = wavelength_nm_;
    lens["half_field_deg"] = 0;
    lens["pivot_z_mm"] = 0;
    lens["image_z_mm"] = image_z(draft);
    if (!glasses_.own_glasses().empty()) lens["glasses"] = glasses_.own_glasses();
    lens["elements"] = std::move(elements);
    lens["stops"] = std::move(stops);
    if (!design_.published.empty()) lens["published"] = design_.published;
    return draft;
  }

 private:
  void problem(const Surface& surface, const std::string& message) {
    problems_.push_back({design_.file, surface.line, 0, "", message});
  }

  // Throws all problems of surfaces, together with those of glasses, which group() has not processed yet.
  void throw_problems() {
    if (problems_.empty()) return;
    for (const Surface& surface : design_.surfaces) {
      OrderedJson face;
      if (!surface.glass.empty()) glasses_.write(surface, face);
    }
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
                           "found only " + std::to_string(design_.surfaces.size()) +
                               " surfaces; a lens needs at least an object, two faces or a mirror, and an image"});
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

  void group(OrderedJson& elements, LensDraft& draft) {
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
        if (elements.empty()) design_.first_vertex_mm = first_z_ = front->translation.z;
        elements.push_back(
            {{"name", surface.mirror ? "M" + std::to_string(++mirrors) : "L" + std::to_string(++lenses)}});
        write_placement(surface, *front, elements.back());
        elements.back()["faces"] = OrderedJson::array();
      }
      OrderedJson& faces = elements.back()["faces"];
      draft.surface_of["/elements/" + std::to_string(elements.size() - 1) + "/faces/" + std::to_string(faces.size())] =
          i;
      faces.push_back(face_of(surface, *front, frames_[i], behind));
      last_z_ = faces.back()["z_mm"].get<double>();
    }
    if (elements.empty()) {
      problems_.push_back({design_.file, 0, 0, "", "no lens found: no surface is followed by glass"});
      return;
    }
    const double image_z = frames_.back().translation.z - first_z_;
    if (has_mirrors() && direction_ * (image_z - last_z_) < -kNothing)
      problem(design_.surfaces.back(),
              "the image is in front of the last face, along the light; distances behind an odd number of mirrors are "
              "negative");
  }

  OrderedJson face_of(const Surface& surface, const Motion& front, const Motion& frame, const Surface* behind) {
    const Motion within = after(optics::inverse(front), frame);
    if (!straight(within) || !on_axis(within))
      problem(surface, "surface " + surface.label +
                           " is tilted or decentred relative to the front of its own element; elements must be "
                           "bodies of revolution");
    OrderedJson face;
    face["z_mm"] = tidy(front.translation.z - first_z_ + within.translation.z);
    face["radius_mm"] = nullptr;
    if (std::fabs(surface.curvature) > kFlat) face["radius_mm"] = radius_of(surface.curvature);
    if (surface.conic != 0) face["conic"] = surface.conic;
    write_terms(surface, face);
    if (surface.mirror)
      face["mirror"] = true;
    else if (behind != nullptr)
      glasses_.write(*behind, face);
    face["clear_radius_mm"] = tidy(surface.clear_radius_mm);
    return face;
  }

  static void write_terms(const Surface& surface, OrderedJson& face) {
    const std::vector<double>& even = surface.even_asphere;
    if (!even.empty() && even[0] != 0) face["r2"] = even[0];
    if (even.size() > 1) face["even_asphere"] = std::vector<double>(even.begin() + 1, even.end());
    if (!surface.odd_asphere.empty()) face["odd_asphere"] = surface.odd_asphere;
    const auto write = [&](const char* key, const std::optional<QAsphere>& asphere) {
      if (asphere) face[key] = {{"radius_mm", asphere->radius_mm}, {"coefficients", asphere->coefficients}};
    };
    write("q_bfs", surface.q_bfs);
    write("q_con", surface.q_con);
  }

  // Curvatures in files usually come from a radius: the nearest of 13 digits if it gives the same curvature.
  static double radius_of(double curvature) {
    constexpr int kDigits = 13;
    const double radius = 1 / curvature, nearest = rounded(radius, kDigits);
    return std::fabs(nearest * curvature - 1) < 1e-14 ? nearest : radius;
  }

  // p_lens = front vertex + Rx Ry (p - front vertex) + shift. A rotation about the element's own axis has no effect.
  void write_placement(const Surface& surface, const Motion& front, OrderedJson& element) {
    if (straight(front) && on_axis(front)) return;
    if (front.rotation[8] <= 0) {
      problem(surface, "surface " + surface.label + " is tilted by 90 degrees or more");
      return;
    }
    const double rx = degrees(std::atan2(-front.rotation[5], front.rotation[8]));
    const double ry = degrees(std::asin(std::clamp(front.rotation[2], -1.0, 1.0)));
    element["placement"] = {{"tilt_deg", {tidy(rx), tidy(ry)}},
                            {"shift_mm", {tidy(front.translation.x), tidy(front.translation.y), 0}}};
  }

  // Writes the stop's place in the surface order if its position on the axis does not imply it: on a face, inside
  // glass, or in front of a vertex that comes earlier in the file.
  void write_stop(const OrderedJson& elements, OrderedJson& stops, LensDraft& draft) {
    for (std::size_t i = 1; i < design_.surfaces.size(); ++i) {
      const Surface& surface = design_.surfaces[i];
      if (!surface.stop) continue;
      if (!straight(frames_[i]) || !on_axis(frames_[i]))
        problem(surface,
                "the stop (surface " + surface.label + ") is tilted or off the axis; stops must be on the axis");
      const double z = tidy(frames_[i].translation.z - first_z_);
      draft.surface_of["/stops/0"] = i;
      OrderedJson stop = {{"name", "aperture stop"},
                          {"z_mm", z},
                          {"opening_radius_mm", tidy(surface.clear_radius_mm)},
                          {"in_listing", true},
                          {"aperture", true}};
      std::size_t before = 0;  // faces that light passes before the stop
      bool in_glass = false, on_face = false, in_order = true;
      for (std::size_t e = 0; e < elements.size(); ++e) {
        const OrderedJson& faces = elements[e]["faces"];
        for (std::size_t f = 0; f < faces.size(); ++f) {
          const std::size_t own = draft.surface_of.at("/elements/" + std::to_string(e) + "/faces/" + std::to_string(f));
          on_face = on_face || own == i;
          before += own < i ? 1 : 0;
          in_glass = own < i ? f + 1 < faces.size() : in_glass;
          in_order = in_order && (own < i ? faces[f]["z_mm"] <= z : own == i || faces[f]["z_mm"] >= z);
        }
      }
      if (on_face)
        stop["on_face"] = before + 1;
      else if (in_glass || !in_order || has_mirrors())
        stop["before_face"] = before + 1;
      stops.push_back(std::move(stop));
    }
  }

  double image_z(LensDraft& draft) const {
    // CODE V writes a defocus as the image's thickness.
    double z = frames_.back().translation.z - first_z_;
    if (design_.format != "Zemax" && std::fabs(design_.surfaces.back().thickness_mm) < kInfinite)
      z += design_.surfaces.back().thickness_mm;
    draft.image_stated = direction_ * (z - last_z_) > kNothing;
    return draft.image_stated ? tidy(z) : last_z_ + direction_;
  }

  LensDesign& design_;
  double wavelength_nm_;
  GlassChoice glasses_;
  std::vector<Problem> problems_;
  std::vector<Motion> frames_;
  double first_z_ = 0, last_z_ = 0;
  double direction_ = 1;  // of the light behind the last face: +-z
};

}  // namespace

namespace {

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

}  // namespace relign::lens_files
