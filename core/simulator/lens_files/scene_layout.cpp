#include "lens_files/scene_layout.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/axial_rays.h"
#include "lens_files/text_lines.h"
#include "optics/face_shape.h"
#include "optics/first_order.h"

namespace relign::lens_files {
namespace {

// The paper's scene in shares of its sensor's side: 0.19 sideways and along the axis, 7 degrees.
constexpr double kMargin = 1.3, kTravelShare = 0.15, kTravelTilt_deg = 7;
// Of a camera line: the chart's side on the sensor, in shares of the sensor's longer side; tilt of a goniometer; where
// a gripper holds the lens, 3 sigma.
constexpr double kChartShare = 1.02, kCameraTilt_deg = 2, kGripAcross_um = 150, kGripAlong_um = 90,
                 kGripTilt_arcmin = 60;
constexpr int kTexels = 1200;
constexpr double kWidestTarget_deg = 60;  // a flat emitter for wider fields would be too large

[[noreturn]] void refuse(const std::string& why) { throw Error(ErrorKind::bad_input, why); }

// Tolerances usual for a focal length: 10 um and 3 arcmin at 5 mm, 100 um and 12 arcmin at 50 mm.
struct Grade {
  double shift_um = 0, tilt_arcmin = 0;
  std::string text() const { return shortest(shift_um) + " um, " + shortest(tilt_arcmin) + " arcmin"; }
};

double nearest_of(const std::vector<double>& friendly, double value) {
  return *std::min_element(friendly.begin(), friendly.end(),
                           [&](double a, double b) { return std::fabs(a - value) < std::fabs(b - value); });
}

Grade grade_of(double focal_length_mm) {
  constexpr double kSmall_mm = 5, kFactor = 10;
  // 0 for lenses of a few millimetres, 1 from 50 mm on, logarithmic in between.
  const double size = std::clamp(std::log(focal_length_mm / kSmall_mm) / std::log(kFactor), 0.0, 1.0);
  return {nearest_of({10, 15, 20, 25, 30, 40, 50, 60, 80, 100}, 10 * std::pow(10, size)),
          nearest_of({3, 4, 5, 6, 8, 10, 12}, 3 * std::pow(4, size))};
}

// Half of the travel: shifts along x and y, along the axis, and tilts.
struct Travel {
  double sideways_mm = 0, along_mm = 0, tilt_deg = 0;
};

// Along the axis and in tilt only as far as the lens stays clear of the sensor: phone lenses end a fraction of a
// millimetre in front of it.
Travel travel_of(const optics::Prescription& lens, double focus, double side_mm, double most_tilt_deg) {
  constexpr double kShare = 0.9, kFineness_deg = 0.1;
  const optics::Face& last = lens.elements.back().faces.back();
  double rear = last.z_mm;
  for (int i = 1; i <= 32; ++i) rear = std::max(rear, last.z_mm + optics::sag(last, last.clear_radius_mm * i / 32));
  const double gap = focus - rear;
  Travel travel{rounded(kTravelShare * side_mm, 3), 0, most_tilt_deg};
  travel.along_mm = rounded(std::min({travel.sideways_mm, 0.5 * (focus - last.z_mm), 0.5 * gap}), 3);
  const double sine = (kShare * gap - travel.along_mm) / last.clear_radius_mm;
  const double limit_deg = sine < 1 ? std::asin(std::max(0.0, sine)) * 57.29577951308232 : most_tilt_deg;
  if (limit_deg < most_tilt_deg)
    travel.tilt_deg = rounded(std::max(kFineness_deg, std::floor(limit_deg / kFineness_deg) * kFineness_deg), 6);
  return travel;
}

OrderedJson tolerances_of(const optics::Prescription& lens, const Grade& grade, const Travel& travel, bool camera) {
  OrderedJson elements = OrderedJson::object();
  const double shift = grade.shift_um, tilt = grade.tilt_arcmin;
  for (const optics::Element& element : lens.elements)
    elements[element.name] = {
        {"shift_um", {shift, shift, shift}}, {"tilt_arcmin", {tilt, tilt}}, {"pivot", "own_front"}};
  double sideways_um = rounded(500 * travel.sideways_mm, 3), along_um = rounded(500 * travel.along_mm, 3);
  double half_arcmin = 30 * travel.tilt_deg;
  if (camera) {
    sideways_um = std::min(sideways_um, kGripAcross_um);
    along_um = std::min(along_um, kGripAlong_um);
    half_arcmin = std::min(half_arcmin, kGripTilt_arcmin);
  }
  return {{"use", "tolerances"},
          {"limits_are_sigmas", 3},
          {"elements", elements},
          {"start", {{"shift_um", {sideways_um, sideways_um, along_um}}, {"tilt_arcmin", {half_arcmin, half_arcmin}}}},
          {"movement", {{"cross_talk", 0.01}, {"backlash_um", 0}, {"repeatability_um", 0}}},
          {"cure_shift", {{"shift_um", {0, 0, 0}}, {"tilt_arcmin", {0, 0}}}}};
}

// Compares our first-order values with those in the file: a difference means that something was misread.
void compare_published(LensDesign& design, const optics::FirstOrder& data) {
  constexpr double kAllowed = 2e-3;
  for (const auto& [name, value] :
       {std::pair{"focal_length", data.focal_length}, std::pair{"back_focal_length", data.back_focal_length}}) {
    const auto known = design.published.find(name);
    if (known != design.published.end() && std::fabs(value - known->second) > kAllowed * std::fabs(known->second))
      design.remarks.push_back({0, std::string("differs: ") + name + " is " + significant(value, 6) +
                                       " mm here, the file states " + significant(known->second, 6)});
  }
}

void refuse_mirrors(const LensDesign& design) {
  std::vector<Problem> problems;
  for (const Surface& surface : design.surfaces)
    if (surface.mirror)
      problems.push_back(
          {design.file, surface.line, 0, "",
           "surface " + surface.label + " is a mirror, which images do not support ('lens info' and 'lens draw' do)"});
  throw_if_any(problems);
}

// "wavelengths" of a scene file. A weight of 0 switches a wavelength off; weights of duplicates are added.
OrderedJson wavelengths_of(const LensDesign& design) {
  constexpr std::size_t kMost = 24;
  OrderedJson found = OrderedJson::array();
  for (std::size_t i = 0; i < design.all_wavelengths_nm.size(); ++i) {
    const double nm = rounded(design.all_wavelengths_nm[i], 9), weight = design.wavelength_weights[i];
    if (!(weight > 0)) continue;
    const auto same =
        std::find_if(found.begin(), found.end(), [nm](const OrderedJson& one) { return one["nm"] == nm; });
    if (same == found.end())
      found.push_back({{"nm", nm}, {"weight", weight}});
    else
      (*same)["weight"] = (*same)["weight"].get<double>() + weight;
  }
  if (found.empty() || found.size() > kMost)
    refuse("--polychromatic: found " + std::to_string(found.size()) +
           " wavelengths with a weight above 0 in the file, allowed are 1 to " + std::to_string(kMost));
  return found;
}

// `field_deg`, or with a remark the largest field below it that the lens images from this distance (0: infinity).
double imaged_field(LensDesign& design, const optics::Prescription& lens, double field_deg, double distance_mm) {
  const std::string no_ray = "no ray from " +
                             (distance_mm > 0 ? "an emitter at " + significant(distance_mm, 6) + " mm" : "infinity") +
                             " passes the centre of the stop at ";
  const auto largest = largest_field(lens, field_deg, distance_mm);
  if (!largest)
    refuse(no_ray + significant(field_deg / 2, 4) + " to " + significant(field_deg, 4) +
           " degrees; check the semi-diameters, the stop's position and the polynomials of the file, or state a "
           "smaller field");
  if (*largest != field_deg)
    design.remarks.push_back({design.field.line, no_ray + significant(field_deg, 4) +
                                                     " degrees; the scene is laid out "
                                                     "for the largest field with one, " +
                                                     significant(*largest, 4) + " degrees"});
  return *largest;
}

struct Distance {
  double mm = 0;
  const char* reason = "";
};

Distance choose_distance(double chosen, double in_file, double side, const optics::FirstOrder& data) {
  if (chosen > 0) return {chosen, "--distance, from the first vertex"};
  if (in_file > 0) return {in_file, "the file's object distance"};
  if (in_file < 0)
    refuse("the object is " + significant(-in_file, 6) +
           " mm behind the first vertex (a virtual object), but targets "
           "must be in front of the lens; give a --distance");
  const double pitch = side / 50;
  return {rounded(3 * (pitch + data.focal_length / data.f_number) * data.focal_length / pitch, 4),
          "3 (p + f / N) f / p with p a fiftieth of the sensor"};  // the paper's formula, p the tolerable blur
}

// What rays and choices decide; lengths in mm.
struct Geometry {
  optics::FirstOrder data;
  SensorSize sensor;
  double side = 0;                      // the shorter one, of the sensor
  double field_deg = 0, shown_deg = 0;  // of the lens, and at the corners of the emitter
  Distance distance;                    // first vertex to emitter
  double focus = 0;                     // first vertex to sensor
  double image_height = 0, emitter_side = 0;
  double sides_deg = 0;  // of the emitter's sides, where they are those of the sensor; 0: the field decides
  Travel travel;

  std::string pixels() const {
    return std::to_string(sensor.columns) + " x " + std::to_string(sensor.rows) + " pixels";
  }
};

// The field whose chief ray meets the sensor at this height, at most the largest one.
double field_of_height(const optics::Prescription& lens, double height_mm, const Geometry& made) {
  double low = 0, high = made.shown_deg;
  for (int round = 0; round < 40; ++round) {
    const double middle = (low + high) / 2;
    (image_height(lens, middle, made.distance.mm, made.focus) < height_mm ? low : high) = middle;
  }
  return high;
}

Geometry solve(LensDesign& design, const optics::Prescription& lens, const LayoutChoices& choices) {
  Geometry made;
  const optics::FirstOrder& data = made.data = optics::first_order(lens);
  if (!(data.focal_length > 0 && std::isfinite(data.focal_length)))
    refuse("found a focal length of " + significant(data.focal_length, 6) +
           " mm; a scene needs a lens that forms an image on a sensor");
  compare_published(design, data);
  // Extent of the image of a distant object; the finite distance moves it slightly.
  made.field_deg = imaged_field(design, lens, lens.half_field_deg, 0);
  const double default_side = rounded(2 * kMargin * image_height(lens, made.field_deg, 0, lens.image_z_mm), 3);
  made.sensor = choices.sensor.value_or(SensorSize::square(default_side));
  made.side = choices.sensor ? made.sensor.shorter_side_mm() : default_side;
  made.distance = choose_distance(choices.distance_mm, design.object_distance_mm().value_or(0), made.side, data);
  made.focus = best_focus_z(lens, made.distance.mm);
  const double last = data.overall_length;
  const std::string emitter = "an emitter at " + significant(made.distance.mm, 6) + " mm is ";
  if (!(made.focus > last))
    refuse("the sharp image of " + emitter + significant(last - made.focus, 4) +
           " mm in front of the lens's last face; " +
           (-made.distance.mm >= data.front_focal_length
                ? "use a larger --distance, beyond the front focal point"
                : "the paraxial focus of distant objects is " + significant(data.back_focal_length, 4) +
                      " mm behind it; check the polynomials and the semi-diameters of the file"));
  made.field_deg = imaged_field(design, lens, made.field_deg, made.distance.mm);
  made.image_height = image_height(lens, made.field_deg, made.distance.mm, made.focus);
  made.shown_deg = std::min(made.field_deg, kWidestTarget_deg);
  const auto side_at = [&](double degrees) {
    const optics::SineCosine field = optics::sine_cosine_of_degrees(degrees);
    return rounded(2 * (made.distance.mm + data.entrance_pupil_z) * field.sine / field.cosine, 6);
  };
  made.emitter_side = rounded(side_at(made.shown_deg) * std::sqrt(0.5), 6);
  if (choices.camera) {
    made.sides_deg = field_of_height(lens, kChartShare * made.sensor.longer_side_mm() / 2, made);
    if (const double side = side_at(made.sides_deg); side < made.emitter_side)
      made.emitter_side = side;
    else
      made.sides_deg = 0;
  }
  if (!(made.emitter_side > 0)) refuse(emitter + "behind the entrance pupil; use a larger --distance");
  made.travel = travel_of(lens, made.focus, made.side, choices.camera ? kCameraTilt_deg : kTravelTilt_deg);
  if (!(made.travel.along_mm > 0))
    refuse("the last face reaches the sensor at " + significant(made.focus - last, 4) +
           " mm behind its vertex; the lens needs room to move");
  return made;
}

OrderedJson scene_of(const Geometry& made, const LensDesign& design, const LayoutChoices& choices) {
  const auto& [sideways, along, tilt] = made.travel;
  const double pivot = rounded(made.data.overall_length / 2, 9), distance = made.distance.mm;
  OrderedJson scene = {
      {"use", "lens_system"},
      {"format", 1},
      {"name", choices.name},
      {"summary", choices.name + ": f = " + significant(made.data.focal_length, 4) + " mm, f/" +
                      significant(made.data.f_number, 3) + ", " + made.pixels() + ", target at " +
                      significant(distance, 4) + " mm."},
      {"lens", "lens.json"},
      {"pivot_behind_first_vertex_mm", pivot},
      {"sensor", {{"z_mm", rounded(made.focus - pivot, 9)}}},
      {"emitter",
       {{"z_mm", -rounded(distance + pivot, 12)}, {"side_mm", made.emitter_side}, {"target", choices.target}}},
      {"travel",
       {{"shift_mm", {sideways, sideways, along}}, {"tilt_deg", {tilt, tilt}}, {"rotation_z_deg", kTravelTilt_deg}}},
      {"machine_time",
       {{"speed_mm_per_s", 5}, {"speed_deg_per_s", 5}, {"settle_ms", 40}, {"exposure_ms", 15}, {"readout_ms", 30}}}};
  if (choices.polychromatic) scene["wavelengths"] = wavelengths_of(design);
  OrderedJson& sensor = scene["sensor"];
  if (made.sensor.has_usual_pixels()) {
    sensor["side_mm"] = rounded(made.side, 12);
    sensor["pixels"] = made.sensor.columns;
  } else {
    sensor["pitch_um"] = rounded(made.sensor.pitch_mm * 1000, 12);
    sensor["pixels"] = {made.sensor.columns, made.sensor.rows};
  }
  if (choices.target_is_named) scene["emitter"]["texels"] = kTexels;
  return scene;
}

OrderedJson suite_of(const LayoutChoices& choices) {
  OrderedJson suite = {{"name", choices.suite_name.empty() ? choices.name : choices.suite_name},
                       {"scenes", OrderedJson::array({{{"use", "scene.json"}, {"name", choices.name}}})},
                       {"noise_levels", {"tolerances.json"}},
                       {"algorithms", {"home", "random", "nlopt-sbplx", "through-focus-quick"}},
                       {"protocol", "blind"},
                       {"instances", 20},
                       {"steps", 40}};
  if (!choices.camera) return suite;
  // Little noise but that of the electronics.
  suite["scenes"][0]["parameters"] = {{"sampler", "lattice"}, {"samples", 8}};
  suite["algorithms"] = {"home", "random", "through-focus-quick", "field-focus"};
  suite["steps"] = 12;
  suite["analysis"] = {{"primary", "yield"},
                       {"contrasts", OrderedJson::array({{"field-focus", "through-focus-quick"}})}};
  suite["cycle"] = {{"load_s", 3}, {"dispense_s", 2}, {"cure_s", 4}, {"inspect_s", 2}};
  return suite;
}

std::vector<LayoutLine> lines_of(const Geometry& made, const CompleteLens& complete, const LayoutChoices& choices,
                                 const Layout& layout) {
  const optics::Prescription& lens = complete.lens;
  const optics::FirstOrder& data = made.data;
  const double last = data.overall_length;
  const auto mm = [](double value) { return significant(value, 6) + " mm"; };
  std::vector<LayoutLine> lines = {
      {"wavelength", significant(lens.wavelength_nm, 6) + " nm", "the file's reference, or --wavelength"},
      {"focal length", mm(data.focal_length), "first order"},
      {"back focal length", mm(data.back_focal_length), "first order"},
      {"f-number", significant(data.f_number, 6), "focal length / entrance pupil"},
      {"entrance pupil", mm(data.entrance_pupil_diameter), mm(data.entrance_pupil_z) + " behind the first vertex"},
      {"stop's opening", mm(lens.aperture_stop().opening_radius_mm), complete.opening_reason},
      {"exit pupil", mm(data.exit_pupil_diameter), mm(data.exit_pupil_from_last) + " from the last vertex"},
      {"half field", significant(made.field_deg, 6) + " degrees",
       made.field_deg < lens.half_field_deg ? "the largest with a chief ray" : "the file's largest field"},
      {"image height", mm(made.image_height), "chief ray of the largest field, at the sensor"},
      {"emitter distance", mm(made.distance.mm), made.distance.reason},
      {"emitter side", mm(made.emitter_side),
       made.sides_deg > 0 ? "sides at " + significant(made.sides_deg, 4) + " degrees: the sensor's longer side and 2 %"
                          : "corners at " + significant(made.shown_deg, 4) + " degrees"},
      {"sensor side", mm(made.side),
       made.pixels() + (choices.camera   ? ", from --camera"
                        : choices.sensor ? ", from --sensor"
                                         : ", 1.3 times the image circle")},
      {"sensor behind last face", mm(made.focus - last), "best focus on the axis at that distance"},
      {"design's image plane", mm(lens.image_z_mm - last), "behind the last face, as in the file"},
      {"half travel, sideways", mm(made.travel.sideways_mm), "0.15 of the sensor's shorter side"},
      {"half travel, along the axis", mm(made.travel.along_mm), "the same, at most half the distance to the sensor"},
      {"half travel, tilts", significant(made.travel.tilt_deg, 6) + " degrees",
       made.travel.tilt_deg < (choices.camera ? kCameraTilt_deg : kTravelTilt_deg)
           ? "limited by the distance to the sensor"
       : choices.camera ? "of a goniometer"
                        : "the paper's"},
      {"tolerances", layout.grade,
       "each element, 3 sigma; by focal length (5 mm: 10 um, 3 arcmin; 50 mm: 100 um, 12 arcmin)"}};
  if (choices.camera) {
    const OrderedJson& start = layout.tolerances["start"];
    const OrderedJson &times = layout.scene["machine_time"], &cycle = layout.suite["cycle"];
    const auto all = [](const OrderedJson& values) {
      std::vector<std::string> texts;
      for (const OrderedJson& value : values) texts.push_back(shortest(value));
      return join(texts, ", ");
    };
    lines.push_back({"start", all(start["shift_um"]) + " um; " + all(start["tilt_arcmin"]) + " arcmin",
                     "where a gripper holds the lens, 3 sigma, at most half of the half travel; replace it by yours"});
    const OrderedJson& sensor = layout.scene["sensor"];
    lines.push_back({"target", choices.target, "on a sensor of " + all(sensor["pixels"]) + " pixels"});
    lines.push_back({"cure shift", "0", "of the glue; replace it by yours"});
    lines.push_back({"suite",
                     shortest(layout.suite["instances"]) + " instances, " + shortest(layout.suite["steps"]) + " steps",
                     join(layout.suite["algorithms"].get<std::vector<std::string>>(), ", ") + "; " +
                         shortest(layout.suite["scenes"][0]["parameters"]["samples"]) + " rays a pixel"});
    if (choices.movement.is_null())
      lines.push_back({"stage", "coupling of axes 0.01", "without play or scatter; choose one by --stage"});
    lines.push_back({"stage's speed",
                     shortest(times["speed_mm_per_s"]) + " mm/s, " + shortest(times["speed_deg_per_s"]) + " deg/s",
                     "settling " + shortest(times["settle_ms"]) + ", exposure " + shortest(times["exposure_ms"]) +
                         ", readout " + shortest(times["readout_ms"]) + " ms; replace them by your line's"});
    lines.push_back({"cycle", all(cycle) + " s", "load, dispense, cure, inspect; replace them by your line's"});
  }
  if (!choices.polychromatic) return lines;
  std::vector<std::string> all, weights;
  for (const OrderedJson& one : layout.scene["wavelengths"]) {
    all.push_back(shortest(one["nm"]));
    weights.push_back(shortest(one["weight"]));
  }
  lines.insert(lines.begin() + 1,
               {"wavelengths of images", join(all, ", ") + " nm", "the file's; weights " + join(weights, ", ")});
  return lines;
}

// Of a tolerance file.
void set_stage(Layout& layout, const Json& movement, const std::string& stage) {
  layout.tolerances["movement"] = movement;
  const auto all = [&movement](const char* key, const char* unit) {
    const Json found = movement.value(key, Json(0));
    return (found.is_array() ? found.dump() : shortest(found.get<double>())) + " " + unit;
  };
  layout.lines.push_back({"stage", stage,
                          "backlash " + all("backlash_um", "um") + ", repeatability " +
                              all("repeatability_um", "um, one sigma") + "; replace it by your stage's"});
}

void remark_on(const Geometry& made, const optics::Prescription& lens, const LayoutChoices& choices,
               std::vector<Remark>& remarks) {
  const double last = made.data.overall_length;
  // The travel is at most half the distance to the sensor.
  if (std::fabs(lens.image_z_mm - made.focus) > made.travel.along_mm)
    remarks.push_back({0, "the design's image plane is " + significant(lens.image_z_mm - last, 4) +
                              " mm behind the last face, the best focus of an emitter at " +
                              significant(made.distance.mm, 4) + " mm " + significant(made.focus - last, 4) +
                              " mm: the sensor is placed there, farther away than the travel along the axis, " +
                              significant(made.travel.along_mm, 4) + " mm; check the last distance of the file"});
  if (2 * made.image_height > made.side && !choices.camera)
    remarks.push_back({0, "the image of the field, " + significant(2 * made.image_height, 4) +
                              " mm in diameter, is larger than the sensor, " + significant(made.side, 4) + " mm"});
  constexpr double kFar_mm = 2000;
  const double diagonal = std::hypot(made.sensor.columns, made.sensor.rows) * made.sensor.pitch_mm;
  if (choices.camera && 2 * made.image_height < diagonal)
    remarks.push_back({0, "the image of the field, " + significant(2 * made.image_height, 4) +
                              " mm in diameter, does not fill the sensor, whose diagonal is " +
                              significant(diagonal, 4) + " mm: its corners stay dark"});
  if (choices.camera && made.distance.mm > kFar_mm)
    remarks.push_back({0, "the chart is " + significant(made.distance.mm / 1000, 3) + " m away and " +
                              significant(made.emitter_side / 1000, 3) +
                              " m wide, more than a line has room for; choose a --distance"});
  if (made.shown_deg < made.field_deg && made.sides_deg == 0)
    remarks.push_back({0, "the emitter ends at " + significant(made.shown_deg, 4) + " degrees of the lens's " +
                              significant(made.field_deg, 4) + ": a flat emitter cannot fill such a wide field"});
}

}  // namespace

Layout lay_out(LensDesign& design, const CompleteLens& complete, const LayoutChoices& choices) {
  refuse_mirrors(design);
  try {
    const Geometry made = solve(design, complete.lens, choices);
    const Grade grade = grade_of(made.data.focal_length);
    Layout layout{scene_of(made, design, choices),
                  tolerances_of(complete.lens, grade, made.travel, choices.camera),
                  suite_of(choices),
                  {},
                  grade.text(),
                  made.side / std::min(made.sensor.columns, made.sensor.rows)};
    layout.lines = lines_of(made, complete, choices, layout);
    if (!choices.movement.is_null()) set_stage(layout, choices.movement, choices.stage);
    remark_on(made, complete.lens, choices, design.remarks);
    return layout;
  } catch (const Error& error) {
    throw Error(error.kind(), design.file + ": " + error.what());
  }
}

void set_specification(Layout& layout, double rmse) {
  LayoutLine line{"spec, RMSE", "none", "a shift by one pixel does not change this image"};
  if (const double limit = rounded(rmse, 2); limit > 0) {
    layout.scene["spec"] = {{"rmse", limit}};
    line = {line.what, shortest(limit),
            "of a noise-free image shifted sideways by one pixel; replace it by your product's"};
  }
  layout.lines.push_back(line);
}

void set_own_specification(Layout& layout, const Json& spec, const std::string& file) {
  layout.scene["spec"] = spec;
  layout.lines.push_back({"spec", shown(spec.dump(), 60), file});
}

void set_electronics(Layout& layout, double white) {
  constexpr double kShare = 0.8;
  constexpr int kFullWell = 8000, kReadNoise = 3, kBits = 10;
  layout.scene["sensor"]["electronics"] = {{"saturation", rounded(white / kShare, 2)},
                                           {"full_well_electrons", kFullWell},
                                           {"read_noise_electrons", kReadNoise},
                                           {"bits", kBits}};
  layout.lines.push_back({"electronics", std::to_string(kFullWell) + " electrons",
                          "of a full pixel, white at 80 %; read noise " + std::to_string(kReadNoise) + ", " +
                              std::to_string(kBits) + " bits; replace them by your sensor's"});
}

double camera_lp_per_mm(const Layout& layout) { return rounded(0.125 / layout.pitch_mm, 4); }

std::string set_camera_specification(Layout& layout, double reached) {
  constexpr double kShare = 0.8, kLeastReached = 0.3;
  const double limit = std::floor(100 * kShare * reached) / 100;
  const double lp_per_mm = camera_lp_per_mm(layout);
  layout.scene["spec"] = {{"field_mtf", {{"lp_per_mm", lp_per_mm}, {"tangential", limit}, {"sagittal", limit}}}};
  layout.lines.push_back({"spec, MTF by field", shortest(limit),
                          "at " + shortest(lp_per_mm) +
                              " lp/mm, a quarter of Nyquist; 0.8 of the worst field's at the design's best pose, " +
                              significant(reached, 2) + "; replace it by your product's"});
  if (reached < kLeastReached)
    return "the lens as designed reaches an MTF of " + significant(reached, 2) + " in its worst field at " +
           shortest(lp_per_mm) +
           " lp/mm, a quarter of Nyquist: it does not suit these pixels, or not all of the sensor";
  return "";
}

std::vector<std::string> remark_lines(const LensDesign& design) {
  std::vector<std::string> lines;
  for (const Remark& remark : design.remarks) {
    const auto more = static_cast<std::uint64_t>(remark.more_lines);
    lines.push_back(design.file + ":" + (remark.line > 0 ? std::to_string(remark.line) + ":" : "") + " " + remark.text +
                    (more > 0 ? " (and " + counted(more, "line") + " more)" : ""));
  }
  return lines;
}

std::string readme(const LensDesign& design, const CompleteLens& lens, const LayoutChoices& choices,
                   const Layout& layout) {
  std::string text =
      "# " + choices.name + "\n\nGenerated from " + design.file.substr(design.file.find_last_of('/') + 1) + " (" +
      design.format + ")" + (design.title.empty() ? "" : ": " + shown(design.title, 200)) +
      ".\n\n* `lens.json`: " + counted(lens.lens.elements.size(), "element") +
      " and the stop\n* `scene.json`: sensor, emitter, travel, machine times\n* `tolerances.json`: offsets of elements "
      "and start, 3 sigma; initially a grade by the lens's size (" +
      layout.grade +
      "): replace it by your suppliers'\n* `suite.json`: the methods to compare\n\n"
      "    relign-bench render --scene scene.json -o reference.png\n"
      "    relign-bench validate suite.json\n"
      "    relign-bench run suite.json\n\n"
      "| quantity | value | how |\n|---|---|---|\n";
  for (const LayoutLine& line : layout.lines) text += "| " + line.what + " | " + line.value + " | " + line.why + " |\n";
  const std::vector<std::string> remarks = remark_lines(design);
  text += remarks.empty() ? "\nNo remarks on the file.\n" : "\n## Remarks\n\n";
  for (const std::string& remark : remarks) text += "* " + remark + "\n";
  return text;
}

}  // namespace relign::lens_files
