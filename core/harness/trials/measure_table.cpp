#include "trials/measure_table.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "base/text.h"
#include "images/registration.h"

namespace relign::trials {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::max();

struct Images {
  images::View capture, reference;
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

double measure(const images::View& image, const images::View& reference, const std::string& name,
               const std::string& arguments_json) {
  std::vector<std::string> names;
  for (const Measure& known : measures()) {
    names.emplace_back(known.name);
    if (name != known.name) continue;
    const JsonSource source = JsonSource::from_text(arguments_json.empty() ? "{}" : arguments_json, name);
    std::vector<Problem> problems;
    ObjectReader arguments(source, "", problems);
    throw_if_any(problems);
    const double value = known.of({image, reference}, arguments);
    arguments.reject_unknown();
    throw_if_any(problems);
    return value;
  }
  throw Error(ErrorKind::bad_input, "unknown measure '" + name + "'" + suggestion(name, names));
}

}  // namespace relign::trials
