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

constexpr int kPixels = 200, kMaxPixels = 8000;
// The paper's scene in shares of its sensor's side: 0.19 sideways and along the axis, 7 degrees.
constexpr double kMargin = 1.3, kTravelShare = 0.15, kTravelTilt_deg = 7;
constexpr int kTexels = 1200;
constexpr double kWidestTarget_deg = 60;  // a flat emitter for wider fields would be too large

[[noreturn]] void refuse_sensor(const std::string& text, const std::string& why) {
  throw Error(ErrorKind::bad_input, "--sensor '" + text + "': " + why +
                                        "; write columns, rows and the pitch in um, such as 1920x1280@3.45, or the "
                                        "side of a square in mm, such as 4.8");
}

// Tolerances usual for lenses of this size: 10 um and 3 arcmin at a focal length of 5 mm, 100 um and 12 arcmin at 50
// mm.
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

// How far the lens can tilt and shift along the axis without hitting the sensor: phone lenses end a fraction of a
// millimetre in front of it.
struct Clearance {
  double along_mm = 0, tilt_deg = 0;
};

Clearance clearance_of(const optics::Prescription& lens, double focus, double wanted_along_mm) {
  constexpr double kShare = 0.9, kFineness_deg = 0.1;
  const optics::Face& last = lens.elements.back().faces.back();
  double rear = last.z_mm;
  for (int i = 1; i <= 32; ++i) rear = std::max(rear, last.z_mm + optics::sag(last, last.clear_radius_mm * i / 32));
  const double gap = focus - rear;
  Clearance clearance{rounded(std::min({wanted_along_mm, 0.5 * (focus - last.z_mm), 0.5 * gap}), 3), kTravelTilt_deg};
  const double sine = (kShare * gap - clearance.along_mm) / last.clear_radius_mm;
  const double limit_deg = sine < 1 ? std::asin(std::max(0.0, sine)) * 57.29577951308232 : kTravelTilt_deg;
  if (limit_deg < kTravelTilt_deg)
    clearance.tilt_deg = std::max(kFineness_deg, std::floor(limit_deg / kFineness_deg) * kFineness_deg);
  clearance.tilt_deg = rounded(clearance.tilt_deg, 6);
  return clearance;
}

// Half of the travel: shifts along x and y, along the axis, and tilts.
struct Travel {
  double sideways_mm = 0, along_mm = 0, tilt_deg = 0;
};

OrderedJson tolerances_of(const optics::Prescription& lens, const Grade& grade, const Travel& travel) {
  OrderedJson elements = OrderedJson::object();
  const double shift = grade.shift_um, tilt = grade.tilt_arcmin;
  for (const optics::Element& element : lens.elements)
    elements[element.name] = {
        {"shift_um", {shift, shift, shift}}, {"tilt_arcmin", {tilt, tilt}}, {"pivot", "own_front"}};
  const double sideways_um = rounded(500 * travel.sideways_mm, 3), along_um = rounded(500 * travel.along_mm, 3);
  const double half_arcmin = 30 * travel.tilt_deg;
  return {{"use", "tolerances"},
          {"limits_are_sigmas", 3},
          {"elements", elements},
          {"start", {{"shift_um", {sideways_um, sideways_um, along_um}}, {"tilt_arcmin", {half_arcmin, half_arcmin}}}},
          {"movement", {{"cross_talk", 0.01}, {"backlash_um", 0}, {"repeatability_um", 0}}},
          {"cure_shift", {{"shift_um", {0, 0, 0}}, {"tilt_arcmin", {0, 0}}}}};
}

// Compares our first-order values with those in the file: a difference means that something was misread.
void compare_published(LensDesign& design, const optics::Prescription& lens) {
  constexpr double kAllowed = 2e-3;
  const optics::FirstOrder data = optics::first_order(lens);
  const std::pair<const char*, double> ours[] = {{"focal_length", data.focal_length},
                                                 {"back_focal_length", data.back_focal_length}};
  for (const auto& [name, value] : ours) {
    const auto known = design.published.find(name);
    if (known != design.published.end() && std::fabs(value - known->second) > kAllowed * std::fabs(known->second))
      design.remarks.push_back({0,
                                std::string("differs: ") + name + " is " + significant(value, 6) +
                                    " mm here, the file states " + significant(known->second, 6),
                                0});
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

struct WeightedWavelength {
  double nm = 0, weight = 0;
};

// "wavelengths" of a scene file. A weight of 0 switches a wavelength off; weights of duplicates are added.
std::vector<WeightedWavelength> wavelengths_of(const LensDesign& design) {
  constexpr std::size_t kMost = 24;
  std::vector<WeightedWavelength> found;
  for (std::size_t i = 0; i < design.all_wavelengths_nm.size(); ++i) {
    const double nm = rounded(design.all_wavelengths_nm[i], 9), weight = design.wavelength_weights[i];
    if (!(weight > 0)) continue;
    const auto same =
        std::find_if(found.begin(), found.end(), [nm](const WeightedWavelength& one) { return one.nm == nm; });
    if (same == found.end())
      found.push_back({nm, weight});
    else
      same->weight += weight;
  }
  if (found.empty() || found.size() > kMost)
    throw Error(ErrorKind::bad_input, "--polychromatic: found " + std::to_string(found.size()) +
                                          " wavelengths with a weight above 0 in the file, allowed are 1 to " +
                                          std::to_string(kMost));
  return found;
}

}  // namespace

SensorSize parse_sensor(const std::string& text) {
  constexpr double kLargest_mm = 1000;
  SensorSize sensor;
  const std::size_t cross = text.find('x'), at = text.find('@');
  if (cross == std::string::npos && at == std::string::npos) {
    const auto side = parse_number(text);
    if (!side || !(*side > 0 && *side <= kLargest_mm)) refuse_sensor(text, "expected a side of up to 1000 mm");
    sensor.pitch_mm = *side / kPixels;
    return sensor;
  }
  if (cross == std::string::npos || at == std::string::npos || at < cross)
    refuse_sensor(text, "expected COLUMNSxROWS@PITCH");
  const auto columns = parse_number(text.substr(0, cross));
  const auto rows = parse_number(text.substr(cross + 1, at - cross - 1));
  const auto pitch_um = parse_number(text.substr(at + 1));
  if (!columns || !rows || !pitch_um) refuse_sensor(text, "expected COLUMNSxROWS@PITCH");
  for (const double count : {*columns, *rows})
    if (!(count >= 1 && count <= kMaxPixels) || count != std::floor(count))
      refuse_sensor(text, "expected 1 to " + std::to_string(kMaxPixels) + " pixels a side");
  sensor.columns = static_cast<int>(*columns);
  sensor.rows = static_cast<int>(*rows);
  sensor.pitch_mm = *pitch_um / 1000;
  const double longest = sensor.pitch_mm * std::max(sensor.columns, sensor.rows);
  if (!(*pitch_um >= 1e-3 && longest <= kLargest_mm)) refuse_sensor(text, "expected a sensor of up to 1000 mm");
  return sensor;
}

Layout lay_out(LensDesign& design, const CompleteLens& complete, const LayoutChoices& choices) {
  refuse_mirrors(design);
  const optics::Prescription& lens = complete.lens;
  const optics::FirstOrder data = optics::first_order(lens);
  if (!(data.focal_length > 0 && std::isfinite(data.focal_length)))
    throw Error(ErrorKind::bad_input, design.file + ": found a focal length of " + significant(data.focal_length, 6) +
                                          " mm; a scene needs a lens that forms an "
                                          "image on a sensor");
  compare_published(design, lens);
  Layout layout;
  const auto line = [&](const std::string& what, double value, const std::string& unit, const std::string& why) {
    layout.lines.push_back({what, significant(value, 6) + (unit.empty() ? "" : " " + unit), why});
  };
  try {
    // Extent of the image of a distant object; the finite distance moves it slightly.
    double field_deg = lens.half_field_deg;
    const auto keep_chief_ray = [&](double distance_mm) {
      const auto largest = largest_field(lens, field_deg, distance_mm);
      const std::string from =
          distance_mm > 0 ? "an emitter at " + significant(distance_mm, 6) + " mm" : std::string("infinity");
      if (!largest)
        throw Error(ErrorKind::bad_input, "no ray from " + from + " passes the centre of the stop at " +
                                              significant(field_deg / 2, 4) + " to " + significant(field_deg, 4) +
                                              " degrees; check the semi-diameters, the stop's position and the "
                                              "polynomials of the file, or state a smaller field");
      if (*largest == field_deg) return;
      design.remarks.push_back({design.field.line,
                                "no ray from " + from + " passes the centre of the stop at " +
                                    significant(field_deg, 4) +
                                    " degrees; the scene is laid out for the largest field "
                                    "with one, " +
                                    significant(*largest, 4) + " degrees",
                                0});
      field_deg = *largest;
    };
    keep_chief_ray(0);
    const double far_height = image_height(lens, field_deg, 0, lens.image_z_mm);
    const double default_side = rounded(2 * kMargin * far_height, 3);
    const SensorSize sensor = choices.sensor.value_or(SensorSize{kPixels, kPixels, default_side / kPixels});
    const double side = choices.sensor ? sensor.shorter_side_mm() : default_side;
    const bool square = sensor.columns == kPixels && sensor.rows == kPixels;
    const std::string pixels = std::to_string(sensor.columns) + " x " + std::to_string(sensor.rows) + " pixels";

    const double file_distance = design.object_distance_mm().value_or(0);
    if (file_distance < 0 && !(choices.distance_mm > 0))
      throw Error(ErrorKind::bad_input, "the object is " + significant(-file_distance, 6) +
                                            " mm behind the first vertex (a virtual object), but targets must be in "
                                            "front of the lens; give a --distance");
    const double pitch = side / 50;
    // The paper's formula with a fiftieth of the sensor as tolerable blur.
    const double by_formula = rounded(3 * (pitch + data.focal_length / data.f_number) * data.focal_length / pitch, 4);
    const bool file_tells = file_distance > 0;
    const double distance = choices.distance_mm > 0 ? choices.distance_mm : file_tells ? file_distance : by_formula;
    const double focus = best_focus_z(lens, distance);
    const double last = data.overall_length;
    if (!(focus > last))
      throw Error(ErrorKind::bad_input,
                  "the sharp image of an emitter at " + significant(distance, 6) + " mm is " +
                      significant(last - focus, 4) + " mm in front of the lens's last face; " +
                      (-distance >= data.front_focal_length
                           ? "use a larger --distance, beyond the front focal point"
                           : "the paraxial focus of distant objects is " + significant(data.back_focal_length, 4) +
                                 " mm behind it; check the polynomials and the semi-diameters of the file"));
    keep_chief_ray(distance);
    const double height = image_height(lens, field_deg, distance, focus);
    const double pivot = rounded(last / 2, 9);
    const double shown_deg = std::min(field_deg, kWidestTarget_deg);
    const optics::SineCosine field = optics::sine_cosine_of_degrees(shown_deg);
    // The corners are at the full field.
    const double emitter_side =
        rounded(2 * (distance + data.entrance_pupil_z) * field.sine / field.cosine * std::sqrt(0.5), 6);
    if (!(emitter_side > 0))
      throw Error(ErrorKind::bad_input, "an emitter at " + significant(distance, 6) +
                                            " mm is behind the entrance pupil; use a larger --distance");
    const double sideways = rounded(kTravelShare * side, 3);
    const Clearance clearance = clearance_of(lens, focus, sideways);
    const double along = clearance.along_mm, tilt_deg = clearance.tilt_deg;
    if (!(along > 0))
      throw Error(ErrorKind::bad_input, "the last face reaches the sensor at " + significant(focus - last, 4) +
                                            " mm behind its vertex; the lens needs room to move");

    layout.scene = {
        {"use", "lens_system"},
        {"format", 1},
        {"name", choices.name},
        {"summary", choices.name + ": f = " + significant(data.focal_length, 4) + " mm, f/" +
                        significant(data.f_number, 3) + ", " + pixels + ", target at " + significant(distance, 4) +
                        " mm."},
        {"lens", "lens.json"},
        {"pivot_behind_first_vertex_mm", pivot},
        {"sensor", {{"z_mm", rounded(focus - pivot, 9)}}},
        {"emitter", {{"z_mm", -rounded(distance + pivot, 12)}, {"side_mm", emitter_side}, {"target", choices.target}}},
        {"travel",
         {{"shift_mm", {sideways, sideways, along}},
          {"tilt_deg", {tilt_deg, tilt_deg}},
          {"rotation_z_deg", kTravelTilt_deg}}},
        {"machine_time",
         {{"speed_mm_per_s", 5}, {"speed_deg_per_s", 5}, {"settle_ms", 40}, {"exposure_ms", 15}, {"readout_ms", 30}}}};
    std::vector<WeightedWavelength> wavelengths;
    if (choices.polychromatic) wavelengths = wavelengths_of(design);
    for (const auto& [nm, weight] : wavelengths)
      layout.scene["wavelengths"].push_back({{"nm", nm}, {"weight", weight}});
    OrderedJson& of_sensor = layout.scene["sensor"];
    if (square) {
      of_sensor["side_mm"] = rounded(side, 12);
      of_sensor["pixels"] = kPixels;
    } else {
      of_sensor["pitch_um"] = rounded(sensor.pitch_mm * 1000, 12);
      of_sensor["pixels"] = {sensor.columns, sensor.rows};
    }
    if (choices.target_is_named) layout.scene["emitter"]["texels"] = kTexels;
    const Grade grade = grade_of(data.focal_length);
    layout.tolerances = tolerances_of(lens, grade, {sideways, along, tilt_deg});
    layout.grade = grade.text();
    layout.pitch_mm = side / (square ? kPixels : std::min(sensor.columns, sensor.rows));
    layout.suite = {{"name", choices.suite_name.empty() ? choices.name : choices.suite_name},
                    {"scenes", OrderedJson::array({{{"use", "scene.json"}, {"name", choices.name}}})},
                    {"noise_levels", {"tolerances.json"}},
                    {"algorithms", {"home", "random", "nlopt-sbplx", "through-focus-quick"}},
                    {"protocol", "blind"},
                    {"instances", 20},
                    {"steps", 40}};
    if (choices.camera) {
      OrderedJson& scene = layout.suite["scenes"][0];
      scene["parameters"] = {{"sampler", "lattice"}, {"samples", 8}};  // little noise but that of the electronics
      layout.suite["algorithms"] = {"home", "random", "through-focus-quick", "field-focus"};
      layout.suite["steps"] = 12;
      layout.suite["analysis"] = {{"primary", "yield"},
                                  {"contrasts", OrderedJson::array({{"field-focus", "through-focus-quick"}})}};
      layout.suite["cycle"] = {{"load_s", 3}, {"dispense_s", 2}, {"cure_s", 4}, {"inspect_s", 2}};
    }

    line("wavelength", lens.wavelength_nm, "nm", "the file's reference, or --wavelength");
    if (choices.polychromatic) {
      std::string all, weights;
      for (const auto& [nm, weight] : wavelengths) {
        all += (all.empty() ? "" : ", ") + shortest(nm);
        weights += (weights.empty() ? "" : ", ") + shortest(weight);
      }
      layout.lines.push_back({"wavelengths of images", all + " nm", "the file's; weights " + weights});
    }
    line("focal length", data.focal_length, "mm", "first order");
    line("back focal length", data.back_focal_length, "mm", "first order");
    line("f-number", data.f_number, "", "focal length / entrance pupil");
    line("entrance pupil", data.entrance_pupil_diameter, "mm",
         significant(data.entrance_pupil_z, 6) + " mm behind the first vertex");
    line("stop's opening", lens.aperture_stop().opening_radius_mm, "mm", complete.opening_reason);
    line("exit pupil", data.exit_pupil_diameter, "mm",
         significant(data.exit_pupil_from_last, 6) + " mm from the last vertex");
    line("half field", field_deg, "degrees",
         field_deg < lens.half_field_deg ? "the largest with a chief ray" : "the file's largest field");
    line("image height", height, "mm", "chief ray of the largest field, at the sensor");
    line("emitter distance", distance, "mm",
         choices.distance_mm > 0 ? "--distance, from the first vertex"
         : file_tells            ? "the file's object distance"
                                 : "3 (p + f / N) f / p with p a fiftieth of the sensor");
    line("emitter side", emitter_side, "mm", "corners at " + significant(shown_deg, 4) + " degrees");
    line("sensor side", side, "mm", pixels + (choices.sensor ? ", from --sensor" : ", 1.3 times the image circle"));
    line("sensor behind last face", focus - last, "mm", "best focus on the axis at that distance");
    line("design's image plane", lens.image_z_mm - last, "mm", "behind the last face, as in the file");
    line("half travel, sideways", sideways, "mm", "0.15 of the sensor's shorter side");
    line("half travel, along the axis", along, "mm", "the same, at most half the distance to the sensor");
    line("half travel, tilts", tilt_deg, "degrees",
         tilt_deg < kTravelTilt_deg ? "limited by the distance to the sensor" : "the paper's");
    layout.lines.push_back(
        {"tolerances", layout.grade,
         "each element, 3 sigma; by focal length (5 mm: 10 um, 3 arcmin; 50 mm: 100 um, 12 arcmin)"});
    const double design_z = lens.image_z_mm, off = std::fabs(design_z - focus);
    if (off > along)  // the travel is at most half the distance to the sensor
      design.remarks.push_back({0,
                                "the design's image plane is " + significant(design_z - last, 4) +
                                    " mm behind the last face, the best focus of an emitter at " +
                                    significant(distance, 4) + " mm " + significant(focus - last, 4) +
                                    " mm: the sensor is placed there, farther away than the travel along the axis, " +
                                    significant(along, 4) + " mm; check the last distance of the file",
                                0});
    if (2 * height > side)
      design.remarks.push_back({0,
                                "the image of the field, " + significant(2 * height, 4) +
                                    " mm in diameter, is larger than the sensor, " + significant(side, 4) + " mm",
                                0});
    if (shown_deg < field_deg)
      design.remarks.push_back({0,
                                "the emitter ends at " + significant(shown_deg, 4) + " degrees of the lens's " +
                                    significant(field_deg, 4) + ": a flat emitter cannot fill such a wide field",
                                0});
  } catch (const Error& error) {
    throw Error(error.kind(), design.file + ": " + error.what());
  }
  return layout;
}

void set_specification(Layout& layout, double rmse) {
  const double limit = rounded(rmse, 2);
  if (!(limit > 0)) {
    layout.lines.push_back({"spec, RMSE", "none", "a shift by one pixel does not change this image"});
    return;
  }
  layout.scene["spec"] = {{"rmse", limit}};
  layout.lines.push_back({"spec, RMSE", shortest(limit),
                          "of a noise-free image shifted sideways by one pixel; replace it by your product's"});
}

std::string chart_for(const SensorSize& sensor) {
  constexpr int kMost = 9, kFewest = 2;
  constexpr double kSquare_px = 42;  // half of the spacing; fields need 40
  const int squares = static_cast<int>(std::max(sensor.columns, sensor.rows) / (2 * kSquare_px));
  return "camera_chart:squares=" + std::to_string(std::clamp(squares, kFewest, kMost));
}

void set_electronics(Layout& layout, double white) {
  constexpr double kShare = 0.8;
  constexpr int kFullWell = 8000, kReadNoise = 3, kBits = 10;
  const double saturation = rounded(white / kShare, 2);
  layout.scene["sensor"]["electronics"] = {{"saturation", saturation},
                                           {"full_well_electrons", kFullWell},
                                           {"read_noise_electrons", kReadNoise},
                                           {"bits", kBits}};
  layout.lines.push_back({"electronics", std::to_string(kFullWell) + " electrons",
                          "of a full pixel, white at 80 %; read noise " + std::to_string(kReadNoise) + ", " +
                              std::to_string(kBits) + " bits; replace them by your sensor's"});
}

double camera_lp_per_mm(const Layout& layout) { return rounded(0.125 / layout.pitch_mm, 4); }

void set_camera_specification(Layout& layout, double reached) {
  constexpr double kShare = 0.8;
  const double limit = std::floor(100 * kShare * reached) / 100;
  const double lp_per_mm = camera_lp_per_mm(layout);
  layout.scene["spec"] = {{"field_mtf", {{"lp_per_mm", lp_per_mm}, {"tangential", limit}, {"sagittal", limit}}}};
  layout.lines.push_back({"spec, MTF by field", shortest(limit),
                          "at " + shortest(lp_per_mm) +
                              " lp/mm, a quarter of Nyquist; 0.8 of the worst field's at the "
                              "design's best pose, " +
                              significant(reached, 2) + "; replace it by your product's"});
}

std::vector<std::string> remark_lines(const LensDesign& design) {
  std::vector<std::string> lines;
  for (const Remark& remark : design.remarks) {
    std::string text =
        design.file + ":" + (remark.line > 0 ? std::to_string(remark.line) + ":" : "") + " " + remark.text;
    if (remark.more_lines > 0)
      text += " (and " + counted(static_cast<std::uint64_t>(remark.more_lines), "line") + " more)";
    lines.push_back(text);
  }
  return lines;
}

std::string readme(const LensDesign& design, const CompleteLens& lens, const LayoutChoices& choices,
                   const Layout& layout) {
  std::string text =
      "# " + choices.name + "\n\nGenerated from " + design.file.substr(design.file.find_last_of('/') + 1) + " (" +
      design.format + ")" + (design.title.empty() ? "" : ": " + shown(design.title, 200)) +
      ".\n\n"
      "* `lens.json`: " +
      counted(lens.lens.elements.size(), "element") +
      " and the stop\n"
      "* `scene.json`: sensor, emitter, travel, machine times\n"
      "* `tolerances.json`: offsets of elements and start, 3 sigma; initially a grade by the lens's size (" +
      layout.grade +
      "): replace it by your suppliers'\n"
      "* `suite.json`: the methods to compare\n\n"
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
