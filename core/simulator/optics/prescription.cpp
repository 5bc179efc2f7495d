#include "optics/prescription.h"

#include <algorithm>
#include <cmath>

#include "base/json_members.h"
#include "base/schema.h"
#include "base/text.h"
#include "optics/face_shape.h"
#include "optics/glass.h"

extern "C" {
extern const unsigned char relign_schema_lens[];
extern const unsigned long relign_schema_lens_size;
}

namespace relign::optics {
namespace {

bool lies_before(const Stop& stop, const Element& element) { return stop.z_mm < element.faces.back().z_mm; }

class Reader {
 public:
  // other_nm: replaces the file's wavelength.
  explicit Reader(const JsonSource& source, std::optional<double> other_nm = std::nullopt)
      : source_(source), other_nm_(other_nm) {}

  Prescription read() {
    static const Schema schema(relign_schema_lens, relign_schema_lens_size);
    const Json file = schema.checked(source_, problems_);
    throw_if_any(problems_);  // the values in place of wrong ones would have mistakes of their own
    lens_.name = file["name"];
    lens_.source = text_of(file, "source");
    lens_.wavelength_nm = other_nm_ ? *other_nm_ : file.value("wavelength_nm", 0.0);
    lens_.pivot_z_mm = file["pivot_z_mm"];
    lens_.image_z_mm = file["image_z_mm"];
    lens_.half_field_deg = file["half_field_deg"];
    lens_.entrance_pupil_diameter_mm = file.value("entrance_pupil_diameter_mm", 0.0);
    for (const auto& [name, glass] : object_of(file, "glasses").items()) read_own_glass(name, glass);
    each(file, "elements", [this](const Json& element, const std::string& at) { read_element(element, at); });
    each(file, "stops", [this](const Json& stop, const std::string& at) { read_stop(stop, at); });
    if (const auto mount = file.find("mount"); mount != file.end()) {
      lens_.barrel = {(*mount)["bore_radius_mm"], (*mount)["from_z_mm"], (*mount)["to_z_mm"]};
      if (lens_.barrel->to_z_mm <= lens_.barrel->from_z_mm)
        complain("/mount/to_z_mm", "the barrel ends at z = " + shortest(lens_.barrel->to_z_mm) +
                                       " mm, before it begins; it must be larger than 'from_z_mm'");
    }
    for (const auto& [name, value] : object_of(file, "published").items()) lens_.published.push_back({name, value});
    if (problems_.empty()) check_whole();
    throw_if_any(problems_);
    return lens_;
  }

 private:
  template <class Body>
  static void each(const Json& parent, const std::string& key, Body&& body, const std::string& at = "") {
    const Json& list = parent[key];
    for (std::size_t i = 0; i < list.size(); ++i) body(list[i], at + "/" + key + "/" + std::to_string(i));
  }

  // The file's own glasses override built-in ones of the same name.
  void read_own_glass(const std::string& name, const Json& file) {
    if (const std::optional<Glass> glass = glass_of(file, source_, "/glasses/" + pointer_word(name), name, problems_))
      own_glasses_.push_back(*glass);
    glass_names_.push_back(name);
  }

  // The index of a named glass; 1 after a mistake.
  double index_of_glass(const std::string& face, const std::string& name) {
    const std::string place = face + "/glass_after";
    if (lens_.wavelength_nm <= 0) {
      complain(place, "a glass needs the lens's wavelength: missing key 'wavelength_nm'");
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
        complain(place, "unknown glass '" + name + "'" + suggestion(name, known) +
                            "; define it under 'glasses', or give its index as 'index_after'");
      return 1.5;
    }
    try {
      return refractive_index(*glass, lens_.wavelength_nm);
    } catch (const Error& error) {
      complain(place, error.what());
      return 1.5;
    }
  }

  void read_element(const Json& file, const std::string& at) {
    Element element;
    element.name = file["name"];
    for (const Element& other : lens_.elements)
      if (other.name == element.name) complain(at + "/name", "duplicate name '" + element.name + "'");
    each(
        file, "faces",
        [&](const Json& face, const std::string& place) {
          element.faces.push_back(read_face(face, place, element.name));
        },
        at);
    if (element.faces.size() == 1 && !element.faces.front().mirror)
      complain(at + "/faces", "expected at least two faces, found 1");
    if (std::fabs(element.faces.back().index_after) != 1 || !element.faces.back().glass.empty())
      complain(at + "/faces",
               "the last face must not have 'index_after' or 'glass_after': the ambient medium follows it");
    for (std::size_t i = 0; i + 1 < element.faces.size(); ++i)
      if (std::fabs(element.faces[i].index_after) == 1)
        complain(at + "/faces/" + std::to_string(i),
                 "missing key 'index_after' (refractive index of the glass) or 'glass_after' (its name)");
    if (const auto placement = file.find("placement"); placement != file.end()) {
      const Json& shift = (*placement)["shift_mm"];
      // About the element's own front vertex.
      element.placement = about({0, 0, element.faces.front().z_mm}, (*placement)["tilt_deg"].get<std::vector<double>>(),
                                {shift[0], shift[1], shift[2]});
    }
    lens_.elements.push_back(element);
  }

  Face read_face(const Json& file, const std::string& at, const std::string& element) {
    const auto refuse = [&](const char* key, const std::string& message) { complain(at + "/" + key, message); };
    Face face;
    face.z_mm = file["z_mm"];
    if (const Json& radius = file["radius_mm"]; radius.is_number()) {  // null: a plane
      if (std::fabs(radius.get<double>()) < 1e-6)
        refuse("radius_mm", "found a radius of " + shortest(radius) + " mm; write null for a plane");
      else
        face.curvature = 1 / radius.get<double>();
    }
    face.conic = file["conic"];
    const double q_radius_mm = read_polynomials(file, at, face);
    face.index_after = file.value("index_after", 1.0);
    face.mirror = file["mirror"];
    if (other_nm_ && face.index_after != 1)
      refuse("index_after", "an image at several wavelengths needs the glass of " + element +
                                ", found its index at one; give 'glass_after': a name, a code such as "
                                "517642, or one of the file's 'glasses'");
    face.glass = text_of(file, "glass_after");
    if (!face.glass.empty()) {
      if (file.contains("index_after")) refuse("glass_after", "give either 'index_after' or 'glass_after'");
      face.index_after = index_of_glass(at, face.glass);
    }
    if (face.mirror && (file.contains("index_after") || file.contains("glass_after")))
      refuse("mirror", "a mirror has no medium behind it; remove 'index_after' or 'glass_after'");
    face.index_after = face.mirror ? -index_before_ : std::copysign(face.index_after, index_before_);
    index_before_ = face.index_after;
    face.clear_radius_mm = file["clear_radius_mm"];
    face.listing_clear_radius_mm = file.value("listing_clear_radius_mm", face.clear_radius_mm);
    const double largest = std::max(face.clear_radius_mm, face.listing_clear_radius_mm);
    put_q_bfs_on_conic(face, std::max(q_radius_mm, largest), at);
    const double steepest = std::sqrt(std::max(0.0, 1 + face.conic)) * std::fabs(face.curvature);
    if (steepest * largest > 1)
      refuse("clear_radius_mm", "the semi-diameter " + shortest(largest) + " mm exceeds the " +
                                    (face.conic == 0 ? "sphere's radius " : "largest radius of the conic ") +
                                    shortest(1 / steepest) + " mm");
    else if (!(std::fabs(sag(face, largest)) < kMaxDepth_mm))
      refuse("clear_radius_mm", "the polynomial has no finite sag at the semi-diameter " + shortest(largest) +
                                    " mm; check the coefficients and their unit");
    return face;
  }

  static constexpr double kMaxDepth_mm = 1e6;

  // Trailing zeros change nothing and are dropped.
  static std::vector<double> terms_of(const Json& file, const char* key) {
    if (!file.contains(key)) return {};
    auto values = file[key].get<std::vector<double>>();
    while (!values.empty() && values.back() == 0) values.pop_back();
    return values;
  }

  // Returns the radius where u of the Q polynomials is 1, mm; 0 without them.
  double read_polynomials(const Json& file, const std::string& at, Face& face) {
    face.r2_term = file["r2"];
    face.even_asphere = terms_of(file, "even_asphere");
    face.odd_asphere = terms_of(file, "odd_asphere");
    double radius_mm = 0;
    if (const auto q = file.find("q_con"); q != file.end()) {
      radius_mm = (*q)["radius_mm"];
      const std::vector<double> even = even_terms_of_q_con(terms_of(*q, "coefficients"), radius_mm);
      face.even_asphere.resize(std::max(face.even_asphere.size(), even.size()));
      for (std::size_t i = 0; i < even.size(); ++i) face.even_asphere[i] += even[i];
    }
    if (const auto q = file.find("q_bfs"); q != file.end()) {
      radius_mm = (*q)["radius_mm"];
      face.over_root = over_root_terms_of_q_bfs(terms_of(*q, "coefficients"), radius_mm);
    }
    if (!face.over_root.empty() && (face.r2_term != 0 || !face.even_asphere.empty()))
      complain(at + "/q_bfs", "the base of 'q_bfs' must be a sphere or a conic; remove the other even polynomials");
    return radius_mm;
  }

  void put_q_bfs_on_conic(Face& face, double reach_mm, const std::string& at) {
    if (face.over_root.empty() || face.conic == 0) return;
    const auto terms = over_root_terms_on_conic(face.over_root, face.curvature, face.conic, reach_mm);
    if (!terms)
      complain(at + "/q_bfs", "terms up to r^32 cannot represent these 'q_bfs' coefficients on a conic of " +
                                  shortest(face.conic) + " to 1e-6 mm; describe the face by 'even_asphere' or 'q_con'");
    face.over_root = terms.value_or(std::vector<double>());
  }

  void read_stop(const Json& file, const std::string& at) {
    Stop stop;
    stop.name = file["name"];
    stop.z_mm = file["z_mm"];
    stop.opening_radius_mm = file["opening_radius_mm"];
    stop.in_listing = file["in_listing"];
    stop.aperture = file["aperture"];
    stop.on_face = file.contains("on_face");
    if (stop.on_face && file.contains("before_face"))
      complain(at + "/on_face", "give either 'before_face' or 'on_face'");
    const char* const key = stop.on_face ? "on_face" : "before_face";
    if (file.contains(key)) {
      const std::size_t face = file[key], last = lens_.face_count() + (stop.on_face ? 0 : 1);
      if (face > last)
        complain(at + "/" + key,
                 "expected an integer from 1 to " + std::to_string(last) + ", found " + std::to_string(face));
      stop.before_face = std::min(face, last) - 1;
    }
    lens_.stops.push_back(stop);
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
