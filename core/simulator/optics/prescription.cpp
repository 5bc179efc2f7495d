#include "optics/prescription.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "optics/face_shape.h"
#include "optics/glass.h"

namespace relign::optics {
namespace {

bool lies_before(const Stop& stop, const Element& element) { return stop.z_mm < element.faces.back().z_mm; }

class Reader {
 public:
  // other_nm: replaces the file's wavelength.
  explicit Reader(const JsonSource& source, std::optional<double> other_nm = std::nullopt)
      : source_(source), other_nm_(other_nm) {}

  Prescription read() {
    ObjectReader top(source_, "", problems_);
    top.integer("format", 1, 1, 1);
    lens_.name = top.required_string("name");
    lens_.source = top.string("source", "");
    lens_.wavelength_nm = top.number("wavelength_nm", 0, 1, 1e6);
    if (other_nm_) lens_.wavelength_nm = *other_nm_;
    lens_.pivot_z_mm = top.number("pivot_z_mm", 0, -1e6, 1e6);
    lens_.image_z_mm = top.required_number("image_z_mm", -1e6, 1e6);
    lens_.half_field_deg = top.number("half_field_deg", 0, 0, 89.9);
    lens_.entrance_pupil_diameter_mm = top.number("entrance_pupil_diameter_mm", 0, 1e-9, 1e6);
    if (top.get("glasses")) read_glasses(top.pointer_to("glasses"));
    each(top, "elements", true, [this](const std::string& at) { read_element(at); });
    each(top, "stops", false, [this](const std::string& at) { read_stop(at); });
    if (top.get("mount")) read_barrel(top.pointer_to("mount"));
    if (const Json* published = top.get("published"); published && published->is_object())
      for (const auto& [name, value] : published->items()) {
        if (value.is_number())
          lens_.published.push_back({name, value.get<double>()});
        else
          problems_.push_back(source_.problem("/published/" + name, "expected a number"));
      }
    top.reject_unknown();
    if (problems_.empty()) check_whole();
    throw_if_any(problems_);
    return lens_;
  }

 private:
  template <class Body>
  void each(ObjectReader& parent, const std::string& key, bool required, Body&& body) {
    const Json* list = parent.get(key);
    if (!list) {
      if (required) parent.complain_missing(key, "a list");
      return;
    }
    if (!list->is_array() || (required && list->empty())) {
      parent.complain(key, "expected a list with at least one entry");
      return;
    }
    for (std::size_t i = 0; i < list->size(); ++i) body(parent.pointer_to(key) + "/" + std::to_string(i));
  }

  // The file's own glasses, which override built-in ones of the same name.
  void read_glasses(const std::string& at) {
    const Json& all = source_.root().at("glasses");
    ObjectReader glasses(source_, at, problems_);
    if (!all.is_object()) return;  // reported by the reader
    for (const auto& [name, value] : all.items()) {
      if (const std::optional<Glass> glass = read_glass(source_, glasses.pointer_to(name), name, problems_))
        own_glasses_.push_back(*glass);
      glass_names_.push_back(name);
    }
  }

  // The index of a named glass; 1 after a mistake.
  double index_of_glass(ObjectReader& face, const std::string& name) {
    if (lens_.wavelength_nm <= 0) {
      face.complain("glass_after", "a glass needs the lens's wavelength: missing key 'wavelength_nm'");
      return 1.5;
    }
    const Glass* glass = nullptr;
    for (const Glass& own : own_glasses_)
      if (own.name == name) glass = &own;
    if (!glass) glass = find_glass(name);
    const std::optional<Glass> coded = glass ? std::nullopt : glass_of_code(name);
    if (coded) glass = &*coded;
    if (!glass) {
      std::vector<std::string> known = optics::glass_names();
      known.insert(known.end(), glass_names_.begin(), glass_names_.end());
      // A mistake in the definition of the glass is reported already.
      if (std::find(glass_names_.begin(), glass_names_.end(), name) == glass_names_.end())
        face.complain("glass_after", "unknown glass '" + name + "'" + suggestion(name, known) +
                                         "; define it under 'glasses', or give its index as 'index_after'");
      return 1.5;
    }
    try {
      return refractive_index(*glass, lens_.wavelength_nm);
    } catch (const Error& error) {
      face.complain("glass_after", error.what());
      return 1.5;
    }
  }

  void read_element(const std::string& at) {
    ObjectReader reader(source_, at, problems_);
    Element element;
    element.name = reader.required_string("name");
    for (const Element& other : lens_.elements)
      if (other.name == element.name) reader.complain("name", "duplicate name '" + element.name + "'");
    reader.string("glass", "");
    each(reader, "faces", true,
         [&](const std::string& face) { element.faces.push_back(read_face(face, element.name)); });
    if (element.faces.size() == 1 && !element.faces.front().mirror)
      reader.complain("faces", "expected at least two faces, found 1");
    if (!element.faces.empty()) {
      if (std::fabs(element.faces.back().index_after) != 1 || !element.faces.back().glass.empty())
        reader.complain("faces",
                        "the last face must not have 'index_after' or 'glass_after': the ambient medium follows it");
      for (std::size_t i = 0; i + 1 < element.faces.size(); ++i)
        if (std::fabs(element.faces[i].index_after) == 1)
          problems_.push_back(source_.problem(reader.pointer_to("faces") + "/" + std::to_string(i),
                                              "missing key 'index_after' (refractive index of the glass) or "
                                              "'glass_after' (its name)"));
      if (reader.get("placement")) read_placement(reader.pointer_to("placement"), element);
    }
    reader.reject_unknown();
    lens_.elements.push_back(element);
  }

  Face read_face(const std::string& at, const std::string& element) {
    ObjectReader reader(source_, at, problems_);
    Face face;
    face.z_mm = reader.required_number("z_mm", -1e6, 1e6);
    if (const Json* radius = reader.get("radius_mm"); radius && radius->is_null()) {
      face.curvature = 0;  // null: a plane
    } else {
      const double value = reader.required_number("radius_mm", -1e9, 1e9);
      if (radius && std::fabs(value) < 1e-6)
        reader.complain("radius_mm", "found a radius of " + shortest(value) + " mm; write null for a plane");
      else if (radius)
        face.curvature = 1 / value;
    }
    face.conic = reader.number("conic", 0, -1e6, 1e6);
    read_polynomials(reader, face);
    face.index_after = reader.number("index_after", 1, 1, 5);
    face.mirror = reader.boolean("mirror", false);
    if (other_nm_ && face.index_after != 1)
      reader.complain("index_after", "an image at several wavelengths needs the glass of " + element +
                                         ", found its index at one; give 'glass_after': a name, a code such as "
                                         "517642, or one of the file's 'glasses'");
    face.glass = reader.string("glass_after", "");
    if (!face.glass.empty()) {
      if (reader.has("index_after")) reader.complain("glass_after", "give either 'index_after' or 'glass_after'");
      face.index_after = index_of_glass(reader, face.glass);
    }
    if (face.mirror && (reader.has("index_after") || reader.has("glass_after")))
      reader.complain("mirror", "a mirror has no medium behind it; remove 'index_after' or 'glass_after'");
    face.index_after = face.mirror ? -index_before_ : std::copysign(face.index_after, index_before_);
    index_before_ = face.index_after;
    face.clear_radius_mm = reader.required_number("clear_radius_mm", 1e-6, 1e6);
    face.listing_clear_radius_mm = reader.number("listing_clear_radius_mm", face.clear_radius_mm, 1e-6, 1e6);
    put_q_bfs_on_conic(reader, face);
    const double largest = std::max(face.clear_radius_mm, face.listing_clear_radius_mm);
    const double steepest = std::sqrt(std::max(0.0, 1 + face.conic)) * std::fabs(face.curvature);
    if (steepest * largest > 1)
      reader.complain("clear_radius_mm", "the semi-diameter " + shortest(largest) + " mm exceeds the " +
                                             (face.conic == 0 ? "sphere's radius " : "largest radius of the conic ") +
                                             shortest(1 / steepest) + " mm");
    else if (!(std::fabs(sag(face, largest)) < kMaxDepth_mm))
      reader.complain("clear_radius_mm", "the polynomial has no finite sag at the semi-diameter " + shortest(largest) +
                                             " mm; check the coefficients and their unit");
    reader.reject_unknown();
    return face;
  }

  static constexpr double kMaxDepth_mm = 1e6;

  // Trailing zeros change nothing and are dropped.
  std::vector<double> read_terms(ObjectReader& reader, const std::string& key, std::size_t most,
                                 const std::string& what) {
    const Json* terms = reader.get(key);
    if (!terms) return {};
    bool numbers = terms->is_array() && !terms->empty() && terms->size() <= most;
    if (numbers)
      for (const Json& term : *terms) numbers = numbers && term.is_number() && std::isfinite(term.get<double>());
    if (!numbers) {
      reader.complain(key, "expected a list of 1 to " + std::to_string(most) + " numbers: " + what);
      return {};
    }
    std::vector<double> values = terms->get<std::vector<double>>();
    while (!values.empty() && values.back() == 0) values.pop_back();
    return values;
  }

  // {"radius_mm": where u is 1, "coefficients": [a0, a1, ...]}
  template <class Convert>
  std::vector<double> read_q_terms(ObjectReader& face, const std::string& key, const Convert& convert) {
    if (!face.get(key)) return {};
    ObjectReader reader(source_, face.pointer_to(key), problems_);
    const double radius = reader.required_number("radius_mm", 1e-6, 1e6);
    q_radius_mm_ = radius;
    if (!reader.get("coefficients")) reader.complain_missing("coefficients", "a list of numbers");
    const std::vector<double> coefficients =
        read_terms(reader, "coefficients", kMaxQTerms, "Forbes's a0, a1, ... in mm");
    reader.reject_unknown();
    return radius > 0 ? convert(coefficients, radius) : std::vector<double>();
  }

  void read_polynomials(ObjectReader& reader, Face& face) {
    face.r2_term = reader.number("r2", 0, -1e6, 1e6);
    face.even_asphere = read_terms(reader, "even_asphere", kMaxEvenTerms, "the coefficients of r^4, r^6, ... in mm");
    face.odd_asphere = read_terms(reader, "odd_asphere", kMaxOddTerms, "the coefficients of r^3, r^5, ... in mm");
    const std::vector<double> q_con = read_q_terms(reader, "q_con", even_terms_of_q_con);
    face.even_asphere.resize(std::max(face.even_asphere.size(), q_con.size()));
    for (std::size_t i = 0; i < q_con.size(); ++i) face.even_asphere[i] += q_con[i];
    face.over_root = read_q_terms(reader, "q_bfs", over_root_terms_of_q_bfs);
    if (!face.over_root.empty() && (face.r2_term != 0 || !face.even_asphere.empty()))
      reader.complain("q_bfs", "the base of 'q_bfs' must be a sphere or a conic; remove the other even polynomials");
  }

  // Needs the semi-diameter.
  void put_q_bfs_on_conic(ObjectReader& reader, Face& face) {
    if (face.over_root.empty() || face.conic == 0) return;
    const double reach = std::max(q_radius_mm_, std::max(face.clear_radius_mm, face.listing_clear_radius_mm));
    const auto terms = over_root_terms_on_conic(face.over_root, face.curvature, face.conic, reach);
    if (!terms)
      reader.complain("q_bfs", "terms up to r^32 cannot represent these 'q_bfs' coefficients on a conic of " +
                                   shortest(face.conic) +
                                   " to 1e-6 mm; describe the face by 'even_asphere' or 'q_con'");
    face.over_root = terms.value_or(std::vector<double>());
  }

  // About the element's own front vertex.
  void read_placement(const std::string& at, Element& element) {
    ObjectReader reader(source_, at, problems_);
    const std::vector<double> tilt = reader.numbers("tilt_deg", 2, {0, 0});
    const std::vector<double> shift = reader.numbers("shift_mm", 3, {0, 0, 0});
    for (const double angle : tilt)
      if (!(angle >= -90 && angle <= 90))
        reader.complain("tilt_deg", "expected tilts from -90 to 90 degrees, found " + shortest(angle));
    reader.reject_unknown();
    element.placement = about({0, 0, element.faces.front().z_mm}, tilt, {shift[0], shift[1], shift[2]});
  }

  void read_stop(const std::string& at) {
    ObjectReader reader(source_, at, problems_);
    Stop stop;
    stop.name = reader.required_string("name");
    stop.z_mm = reader.required_number("z_mm", -1e6, 1e6);
    stop.opening_radius_mm = reader.required_number("opening_radius_mm", 1e-9, 1e6);
    stop.in_listing = reader.boolean("in_listing", false);
    stop.aperture = reader.boolean("aperture", false);
    const auto faces = static_cast<std::int64_t>(lens_.face_count());
    for (const char* key : {"before_face", "on_face"}) reader.get(key);  // marked as known even if absent
    if (reader.has("before_face") && reader.has("on_face"))
      reader.complain("on_face", "give either 'before_face' or 'on_face'");
    if (reader.has("before_face"))
      stop.before_face = static_cast<std::size_t>(reader.integer("before_face", 1, 1, faces + 1) - 1);
    if (reader.has("on_face")) {
      stop.on_face = true;
      stop.before_face = static_cast<std::size_t>(reader.integer("on_face", 1, 1, faces) - 1);
    }
    reader.reject_unknown();
    lens_.stops.push_back(stop);
  }

  void read_barrel(const std::string& at) {
    ObjectReader reader(source_, at, problems_);
    Barrel barrel;
    barrel.bore_radius_mm = reader.required_number("bore_radius_mm", 1e-9, 1e6);
    barrel.from_z_mm = reader.required_number("from_z_mm", -1e6, 1e6);
    barrel.to_z_mm = reader.required_number("to_z_mm", -1e6, 1e6);
    if (barrel.to_z_mm <= barrel.from_z_mm)
      reader.complain("to_z_mm", "the barrel ends at z = " + shortest(barrel.to_z_mm) +
                                     " mm, before it begins; it must be larger than 'from_z_mm'");
    reader.reject_unknown();
    lens_.barrel = barrel;
  }

  void complain(const std::string& pointer, const std::string& message) {
    problems_.push_back(source_.problem(pointer, message));
  }

  void check_whole() {
    // Faces must be in order along the axis, and must not cross within the smaller semi-diameter of a pair.
    const Face* previous = nullptr;
    for (std::size_t e = 0; e < lens_.elements.size(); ++e)
      for (std::size_t f = 0; f < lens_.elements[e].faces.size(); ++f) {
        const Face& face = lens_.elements[e].faces[f];
        const std::string at = "/elements/" + std::to_string(e) + "/faces/" + std::to_string(f);
        if (previous) check_pair(*previous, face, f == 0, at);
        previous = &face;
      }
    if (previous && !comes_after(previous->index_after, previous->z_mm, lens_.image_z_mm))
      complain("/image_z_mm", "the image plane is in front of the last face (z = " + shortest(previous->z_mm) + " mm)");
    std::size_t apertures = 0;
    for (std::size_t s = 0; s < lens_.stops.size(); ++s) {
      const Stop& stop = lens_.stops[s];
      apertures += stop.aperture ? 1 : 0;
      if (stop.on_face)
        check_face_of_stop(stop, "/stops/" + std::to_string(s));
      else if (!stop.before_face && lens_.has_mirrors())
        complain("/stops/" + std::to_string(s),
                 "in a lens with mirrors the position of a stop does not determine its order; give 'before_face' or "
                 "'on_face'");
      else if (!stop.before_face)
        for (const Element& element : lens_.elements)
          check_stop(stop, element, "/stops/" + std::to_string(s) + "/z_mm");
      if (lens_.barrel && stop.opening_radius_mm > lens_.barrel->bore_radius_mm)
        complain("/stops/" + std::to_string(s) + "/opening_radius_mm",
                 "the opening is larger than the bore of the barrel");
    }
    if (apertures != 1)
      complain("/stops", "exactly one stop must have \"aperture\": true, found " + std::to_string(apertures));
  }

  void check_face_of_stop(const Stop& stop, const std::string& at) {
    std::size_t before = *stop.before_face;
    for (const Element& element : lens_.elements) {
      if (before >= element.faces.size()) {
        before -= element.faces.size();
        continue;
      }
      const Face& face = element.faces[before];
      if (std::fabs(stop.z_mm - face.z_mm) > 1e-9)
        complain(at + "/z_mm", "the stop '" + stop.name + "' is the edge of a face of " + element.name +
                                   ": expected the z of that vertex, " + shortest(face.z_mm) + " mm, found " +
                                   shortest(stop.z_mm));
      if (stop.opening_radius_mm > face.clear_radius_mm)
        complain(at + "/opening_radius_mm",
                 "the opening is larger than the semi-diameter of its face, " + shortest(face.clear_radius_mm) + " mm");
      return;
    }
  }

  // The stop's rim must be in air; a convex face may protrude through its opening.
  void check_stop(const Stop& stop, const Element& element, const std::string& at) {
    const Face& front = element.faces.front();
    const double behind = stop.z_mm - front.z_mm;
    if (behind <= 0 || !lies_before(stop, element)) return;
    const double rim_sag = sag(front, stop.opening_radius_mm);
    if (behind <= rim_sag) return;
    complain(at, "the stop '" + stop.name + "' is inside the glass of " + element.name + ": its plane is " +
                     significant(behind, 4) + " mm behind the front vertex, and at the rim of its opening, radius " +
                     significant(stop.opening_radius_mm, 4) + " mm, " +
                     (std::isfinite(rim_sag) ? "the glass begins " + significant(rim_sag, 4) + " mm behind it"
                                             : "the front face has ended") +
                     "; move it to where its rim is in air in front of or behind the glass, or set its place in the "
                     "surface order with 'before_face'");
  }

  // In the direction of light, which is the sign of the index.
  static bool comes_after(double index, double z_mm, double later_mm) {
    return index < 0 ? later_mm < z_mm : later_mm > z_mm;
  }

  // Elements may touch: two faces at one vertex with no air between them.
  void check_pair(const Face& before, const Face& face, bool across_air, const std::string& at) {
    const double index = before.index_after;
    if (!comes_after(index, before.z_mm, face.z_mm) && !(across_air && face.z_mm == before.z_mm)) {
      complain(at + "/z_mm", "the face at z = " + shortest(face.z_mm) + " mm must come after the previous one (" +
                                 shortest(before.z_mm) + " mm)");
      return;
    }
    const double radius = std::min(before.clear_radius_mm, face.clear_radius_mm);
    // Aspheres may come near each other anywhere, not only at the rim.
    constexpr int kPlaces = 16;
    for (int i = kPlaces; i > 0; --i) {
      const double r = radius * i / kPlaces;
      if (!comes_after(index, face.z_mm + sag(face, r), before.z_mm + sag(before, r))) continue;
      complain(at, "the face crosses the previous one within the semi-diameter " + shortest(radius) + " mm");
      return;
    }
  }

  const JsonSource& source_;
  std::optional<double> other_nm_;
  std::vector<Problem> problems_;
  Prescription lens_;
  double index_before_ = 1;  // of the next face, signed
  double q_radius_mm_ = 0;   // of the last Q-type terms
  std::vector<Glass> own_glasses_;
  std::vector<std::string> glass_names_;  // of the file's own, including those with mistakes
};

}  // namespace

std::size_t Prescription::face_count() const {
  std::size_t count = 0;
  for (const Element& element : elements) count += element.faces.size();
  return count;
}

bool Prescription::has_mirrors() const {
  return std::any_of(elements.begin(), elements.end(), [](const Element& element) {
    return std::any_of(element.faces.begin(), element.faces.end(), [](const Face& face) { return face.mirror; });
  });
}

std::size_t Prescription::faces_before(const Stop& stop) const {
  if (stop.before_face) return *stop.before_face;
  std::size_t before = 0;
  for (const Element& element : elements)
    if (!lies_before(stop, element)) before += element.faces.size();
  return before;
}

const Stop& Prescription::aperture_stop() const {
  return *std::find_if(stops.begin(), stops.end(), [](const Stop& stop) { return stop.aperture; });
}

const Element* Prescription::element(const std::string& wanted) const {
  for (const Element& candidate : elements)
    if (candidate.name == wanted) return &candidate;
  return nullptr;
}

Prescription read_prescription(const JsonSource& source) { return Reader(source).read(); }

Prescription read_prescription_at(const JsonSource& source, double wavelength_nm) {
  return Reader(source, wavelength_nm).read();
}

Prescription read_prescription(const std::filesystem::path& file) {
  return read_prescription(JsonSource::from_file(file));
}

}  // namespace relign::optics
