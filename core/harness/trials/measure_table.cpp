#include "trials/measure_table.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "base/text.h"
#include "images/edge_fields.h"
#include "images/registration.h"

namespace relign::trials {
namespace {

using images::Direction;

constexpr double kUnbounded = std::numeric_limits<double>::max();

struct Images {
  images::View capture, reference;
  const SceneFacts& scene;
};

struct Measure {
  const char* name;
  const char* summary;
  std::vector<std::pair<const char*, const char*>> arguments;
  double (*of)(const Images& images, ObjectReader& arguments);
};

double star_contrast(const Images& images, ObjectReader& arguments) {
  images::StarCircle circle;
  circle.cycles = static_cast<int>(arguments.integer("cycles", 0, 1, 10'000));
  if (!arguments.has("cycles")) arguments.complain_missing("cycles", "number of bright spokes");
  const double cycles_per_pixel = arguments.number("cycles_per_pixel", 0, 1e-6, 1);
  circle.radius_px = arguments.number("radius_px", 0, 0, kUnbounded);
  if (arguments.has("cycles_per_pixel") == arguments.has("radius_px"))
    arguments.complain("", "expected either 'cycles_per_pixel' or 'radius_px'");
  else if (arguments.has("cycles_per_pixel"))
    circle.radius_px = circle.cycles / (2 * std::numbers::pi * cycles_per_pixel);
  const images::Moments middle = images::moments(images.capture);
  circle.x_px = arguments.number("x_px", middle.centroid_x_px, -kUnbounded, kUnbounded);
  circle.y_px = arguments.number("y_px", middle.centroid_y_px, -kUnbounded, kUnbounded);
  return images::star_contrast(images.capture, circle);
}

double mtf(const Images& images, ObjectReader& arguments) {
  const images::View& image = images.capture;
  const double cycles_per_pixel = arguments.required_number("cycles_per_pixel", 0, 1);
  const auto width = static_cast<std::int64_t>(image.width), height = static_cast<std::int64_t>(image.height);
  const auto place = [&](const char* key, std::int64_t fallback, std::int64_t largest) {
    return static_cast<std::size_t>(arguments.integer(key, fallback, 0, largest));
  };
  images::Region region;
  region.x = place("x", 0, width);
  region.y = place("y", 0, height);
  region.width = place("width", width - static_cast<std::int64_t>(region.x), width);
  region.height = place("height", height - static_cast<std::int64_t>(region.y), height);
  if (region.x + region.width > image.width || region.y + region.height > image.height)
    arguments.complain(
        "", "the region exceeds the image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels");
  return images::edge_mtf(image, region, cycles_per_pixel);
}

constexpr std::size_t kEveryField = images::kMaxFields;

bool has_fields(const SceneFacts& scene, ObjectReader& arguments) {
  if (scene.fields.empty()) arguments.complain("", "the scene '" + scene.name + "' describes no 'fields'");
  return !scene.fields.empty();
}

// The field that the arguments name, by name or number; kEveryField without one. Complains where there is none.
std::size_t field_of(const Images& images, ObjectReader& arguments) {
  const images::EdgeFields& fields = images.scene.fields;
  const Json* given = arguments.get("field");
  if (!has_fields(images.scene, arguments) || !given) return kEveryField;
  std::vector<std::string> names;
  for (const images::EdgeField& field : fields) names.push_back(field.name);
  if (given->is_string()) {
    const auto named = std::find(names.begin(), names.end(), given->get<std::string>());
    if (named != names.end()) return static_cast<std::size_t>(named - names.begin());
    arguments.complain("field", "unknown field '" + given->get<std::string>() + "'; fields: " + join(names, ", "));
    return kEveryField;
  }
  return static_cast<std::size_t>(arguments.integer("field", 0, 0, static_cast<std::int64_t>(fields.size()) - 1));
}

// In cycles per pixel.
double frequency_of(const SceneFacts& scene, ObjectReader& arguments) {
  const double cycles_per_pixel = arguments.number("cycles_per_pixel", 0, 0, 1);
  const double lp_per_mm = arguments.number("lp_per_mm", 0, 0, kUnbounded);
  if (arguments.has("cycles_per_pixel") == arguments.has("lp_per_mm"))
    arguments.complain("", "expected either 'cycles_per_pixel' or 'lp_per_mm'");
  if (!arguments.has("lp_per_mm")) return cycles_per_pixel;
  const double converted = lp_per_mm * scene.pitch_um / 1000;
  if (!(scene.pitch_um > 0) || converted > 1)
    arguments.complain("lp_per_mm", scene.pitch_um > 0
                                        ? "more than one cycle per pixel of " + shortest(scene.pitch_um) + " um"
                                        : "the scene describes no 'pitch_um'; use 'cycles_per_pixel'");
  return converted;
}

// Of one field or, by default, the lowest of all; of one direction or the lower of both. NaN if any of them is.
double field_mtf(const Images& images, ObjectReader& arguments) {
  const std::size_t field = field_of(images, arguments);
  const double cycles_per_pixel = frequency_of(images.scene, arguments);
  const std::string direction = arguments.string("direction", "");
  if (direction != "" && direction != "tangential" && direction != "sagittal")
    arguments.complain("direction", "found '" + direction + "'; allowed: tangential, sagittal");
  const images::FieldEdges edges(images.capture, images.scene.fields);
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < images.scene.fields.size(); ++i)
    for (const Direction measured : {Direction::tangential, Direction::sagittal}) {
      const bool asked = direction.empty() || (direction == "tangential") == (measured == Direction::tangential);
      const bool shown = images.scene.fields[i].region(measured).has_value();
      if (!asked || !shown || (field != kEveryField && field != i)) continue;
      const double mtf = edges.mtf(i, measured, cycles_per_pixel);
      if (!(mtf >= lowest)) lowest = mtf;
      if (std::isnan(mtf)) return images::kNotMeasurable;
    }
  return lowest <= kUnbounded ? lowest : images::kNotMeasurable;
}

template <double (images::FieldEdges::*place)(std::size_t) const>
double mark_of_field(const Images& images, ObjectReader& arguments) {
  const std::size_t field = field_of(images, arguments);
  if (!arguments.has("field")) arguments.complain_missing("field", "name or number of a field");
  if (field == kEveryField) return images::kNotMeasurable;
  return (images::FieldEdges(images.capture, images.scene.fields).*place)(field);
}

images::Registration registration(const Images& images) {
  return images::registration(images.capture, images.reference);
}

const std::vector<Measure>& measures() {
  static const std::vector<Measure> all = {
      {"mean", "Mean level", {}, [](const Images& images, ObjectReader&) { return images::mean(images.capture); }},
      {"contrast",
       "Standard deviation / mean",
       {},
       [](const Images& images, ObjectReader&) { return images::contrast(images.capture); }},
      {"sharpness",
       "Gradient energy / mean squared (1 / px^2)",
       {},
       [](const Images& images, ObjectReader&) { return images::sharpness(images.capture); }},
      {"centroid_x_px",
       "Centroid of the light above the background, from the middle of the first column",
       {},
       [](const Images& images, ObjectReader&) { return images::moments(images.capture).centroid_x_px; }},
      {"centroid_y_px",
       "Centroid of the light above the background, from the middle of the top row",
       {},
       [](const Images& images, ObjectReader&) { return images::moments(images.capture).centroid_y_px; }},
      {"width_px",
       "Root mean second moment of the light above the background: a Gaussian spot's sigma",
       {},
       [](const Images& images, ObjectReader&) { return images::moments(images.capture).width_px; }},
      {"star_contrast",
       "Modulation of a Siemens star's fundamental wave on a circle",
       {{"cycles", "bright spokes of the star"},
        {"cycles_per_pixel", "spatial frequency: chooses the radius cycles / (2 pi frequency)"},
        {"radius_px", "the radius, instead of cycles_per_pixel"},
        {"x_px", "centre of the star; default: centroid_x_px"},
        {"y_px", "centre of the star; default: centroid_y_px"}},
       star_contrast},
      {"mtf",
       "Modulation transfer across a slanted edge (ISO 12233)",
       {{"cycles_per_pixel", "spatial frequency, 0 to 1"},
        {"x", "left column of the region with the edge; default 0"},
        {"y", "top row of the region; default 0"},
        {"width", "columns; default: all to the right"},
        {"height", "rows; default: all below"}},
       mtf},
      {"field_mtf",
       "Modulation transfer across the slanted edges of a field of the scene (ISO 12233)",
       {{"field", "name or number of the field; default: the lowest of all"},
        {"direction", "tangential or sagittal; default: the lower of both"},
        {"cycles_per_pixel", "spatial frequency, 0 to 1"},
        {"lp_per_mm", "the frequency in line pairs per mm on the sensor, instead of cycles_per_pixel"}},
       field_mtf},
      {"mark_x_px",
       "Centre of a field's mark, from the middle of the first column",
       {{"field", "name or number of the field"}},
       mark_of_field<&images::FieldEdges::mark_x_px>},
      {"mark_y_px",
       "Centre of a field's mark, from the middle of the top row",
       {{"field", "name or number of the field"}},
       mark_of_field<&images::FieldEdges::mark_y_px>},
      {"shift_x_px",
       "Shift to the right, relative to the reference image",
       {},
       [](const Images& images, ObjectReader&) { return registration(images).shift_x_px; }},
      {"shift_y_px",
       "Shift downwards, relative to the reference image",
       {},
       [](const Images& images, ObjectReader&) { return registration(images).shift_y_px; }},
      {"rotation_deg",
       "Rotation about the image centre relative to the reference image, clockwise as displayed",
       {},
       [](const Images& images, ObjectReader&) { return registration(images).rotation_deg; }}};
  return all;
}

}  // namespace

Json list_measures() {
  Json list = Json::array();
  for (const Measure& measure : measures()) {
    Json arguments = Json::object();
    for (const auto& [name, meaning] : measure.arguments) arguments[name] = meaning;
    list.push_back({{"name", measure.name}, {"summary", measure.summary}, {"arguments", arguments}});
  }
  return list;
}

double measure(const images::View& image, const images::View& reference, const SceneFacts& scene,
               const std::string& name, const std::string& arguments_json) {
  std::vector<std::string> names;
  for (const Measure& known : measures()) {
    names.emplace_back(known.name);
    if (name != known.name) continue;
    const JsonSource source = JsonSource::from_text(arguments_json.empty() ? "{}" : arguments_json, name);
    std::vector<Problem> problems;
    ObjectReader arguments(source, "", problems);
    throw_if_any(problems);
    const double value = known.of({image, reference, scene}, arguments);
    arguments.reject_unknown();
    throw_if_any(problems);
    return value;
  }
  throw Error(ErrorKind::bad_input, "unknown measure '" + name + "'" + suggestion(name, names));
}

double cycles_per_pixel_of(const SceneFacts& scene, const std::string& arguments_json) {
  const JsonSource source = JsonSource::from_text(arguments_json.empty() ? "{}" : arguments_json, "fields");
  std::vector<Problem> problems;
  ObjectReader arguments(source, "", problems);
  throw_if_any(problems);
  has_fields(scene, arguments);
  const double cycles_per_pixel = frequency_of(scene, arguments);
  arguments.reject_unknown();
  throw_if_any(problems);
  return cycles_per_pixel;
}

FieldMeasures::FieldMeasures(const images::View& image, const SceneFacts& scene, const std::string& arguments_json) {
  const double cycles_per_pixel = cycles_per_pixel_of(scene, arguments_json);
  const images::FieldEdges edges(image, scene.fields);
  for (std::size_t i = 0; i < scene.fields.size(); ++i) {
    names_.push_back({scene.fields[i].name.data(), scene.fields[i].name.size()});
    mark_x_px_.push_back(edges.mark_x_px(i));
    mark_y_px_.push_back(edges.mark_y_px(i));
    tangential_.push_back(edges.mtf(i, Direction::tangential, cycles_per_pixel));
    sagittal_.push_back(edges.mtf(i, Direction::sagittal, cycles_per_pixel));
  }
}

void FieldMeasures::write(relign_field_measures* fields) const {
  relign_field_measures written{};
  if (!fields || fields->struct_size < sizeof written)
    throw Error(ErrorKind::bad_input, "'fields' is null or its struct_size too small");
  written = {.struct_size = sizeof written,
             .count = static_cast<std::uint32_t>(names_.size()),
             .name = names_.data(),
             .mark_x_px = mark_x_px_.data(),
             .mark_y_px = mark_y_px_.data(),
             .tangential = tangential_.data(),
             .sagittal = sagittal_.data()};
  std::memcpy(fields, &written, sizeof written);
}

}  // namespace relign::trials
