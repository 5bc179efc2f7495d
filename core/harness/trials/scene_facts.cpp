#include "trials/scene_facts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/characters.h"
#include "base/limits.h"
#include "images/score.h"

namespace relign::trials {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<Axis> read_axes(const JsonSource& source, ObjectReader& top, bool owns_stage,
                            std::vector<Problem>& problems) {
  std::vector<Axis> axes;
  const Json* list = top.get("axes");
  if (!list || !list->is_array() || list->empty() || list->size() > kMaxAxes) {
    top.complain("axes", "expected a list of 1 to " + std::to_string(kMaxAxes) + " axes");
    return axes;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader reader(source, "/axes/" + std::to_string(i), problems);
    Axis axis;
    axis.name = reader.required_string("name");
    axis.unit = reader.required_string("unit");
    axis.lower = reader.required_number("lower", -kInfinity, kInfinity);
    axis.upper = reader.required_number("upper", -kInfinity, kInfinity);
    axis.observable = reader.boolean("observable", true);
    axis.speed_per_s = reader.number("speed_per_s", 0, std::numeric_limits<double>::min(), kInfinity);
    reader.reject_unknown();
    if (reader.has("name") && axis.name.empty())
      reader.complain("name", "expected the name of the axis, found an empty string");
    if (reader.has("unit") && (axis.unit.empty() || !line_mistake(axis.unit).empty()))
      reader.complain("unit", "expected 'mm', 'deg' or another unit in one line, found '" + axis.unit + "'");
    const bool timed = axis.unit == "mm" || axis.unit == "deg" || reader.has("speed_per_s") || owns_stage;
    if (reader.has("unit") && !timed)
      reader.complain_missing("speed_per_s", "in '" + axis.unit + "' per second; 'machine_time' has it for mm and deg");
    if (reader.has("lower") && reader.has("upper") && !(axis.lower < axis.upper))
      reader.complain("upper", "must be greater than 'lower'");
    const bool twice = std::any_of(axes.begin(), axes.end(), [&](const Axis& a) { return a.name == axis.name; });
    if (twice && !axis.name.empty()) reader.complain("name", "duplicate axis '" + axis.name + "'");
    axes.push_back(std::move(axis));
  }
  return axes;
}

// Their laws are for noise levels.
std::vector<UncertainQuantity> read_uncertain(const JsonSource& source, ObjectReader& top,
                                              const std::vector<std::string>& elements,
                                              std::vector<Problem>& problems) {
  std::vector<UncertainQuantity> quantities;
  const Json* list = top.get("uncertain");
  if (list && !list->is_array()) top.complain("uncertain", "expected a list of quantities");
  for (std::size_t i = 0; list && list->is_array() && i < list->size(); ++i) {
    ObjectReader reader(source, "/uncertain/" + std::to_string(i), problems);
    UncertainQuantity quantity = {reader.required_string("name"), reader.required_string("unit")};
    reader.string("meaning", "");
    if (const Json* law = reader.get("law"); !law || !law->is_object())
      reader.complain_missing("law", R"(such as {"law": "normal", "sigma": 0.1})");
    reader.reject_unknown();
    const auto is_it = [&quantity](const UncertainQuantity& other) { return other.name == quantity.name; };
    if (reader.has("name") && (quantity.name.empty() || std::any_of(quantities.begin(), quantities.end(), is_it) ||
                               std::find(elements.begin(), elements.end(), quantity.name) != elements.end()))
      reader.complain("name",
                      "expected a name that no other quantity and no element has, found '" + quantity.name + "'");
    quantities.push_back(std::move(quantity));
  }
  return quantities;
}

std::vector<std::string> read_texts(ObjectReader& reader, const std::string& key, bool required) {
  std::vector<std::string> texts;
  const Json* list = reader.get(key);
  if (!list && !required) return texts;
  const bool fits = list && list->is_array() && std::all_of(list->begin(), list->end(), [](const Json& item) {
                      return item.is_string() && !item.get_ref<const std::string&>().empty();
                    });
  if (!fits) {
    reader.complain(key, "expected a list of non-empty strings under '" + key + "'");
    return texts;
  }
  return list->get<std::vector<std::string>>();
}

std::vector<Reading> read_readings(const JsonSource& source, ObjectReader& top, std::vector<Problem>& problems) {
  constexpr std::size_t kMaxReadings = 1000;
  std::vector<Reading> readings;
  const Json* list = top.get("readings");
  if (!list) return readings;
  if (!list->is_array() || list->empty() || list->size() > kMaxReadings) {
    top.complain("readings", "expected a list of 1 to " + std::to_string(kMaxReadings) + " readings");
    return readings;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader reader(source, "/readings/" + std::to_string(i), problems);
    Reading reading = {reader.required_string("name"), reader.string("unit", "")};
    reader.reject_unknown();
    const auto same = [&reading](const Reading& other) { return other.name == reading.name; };
    if (reader.has("name") && (reading.name.empty() || !line_mistake(reading.name).empty() ||
                               std::any_of(readings.begin(), readings.end(), same)))
      reader.complain("name", "expected a name in one line that no other reading has, found '" + reading.name + "'");
    if (!line_mistake(reading.unit).empty()) reader.complain("unit", "expected a unit in one line");
    readings.push_back(std::move(reading));
  }
  return readings;
}

SceneFacts read(const JsonSource& source) {
  std::vector<Problem> problems;
  SceneFacts facts;
  facts.text = source.text();
  // Unknown keys of the description itself are allowed: a scene may pass more to noise levels than we read.
  ObjectReader top(source, "", problems);
  throw_if_any(problems);
  facts.name = top.required_string("name");
  if (top.has("name") && facts.name.empty())
    top.complain("name", "expected the name of the scene, found an empty string");
  facts.summary = top.string("summary", "");
  facts.owns_stage = top.boolean("owns_stage", false);
  facts.axes = read_axes(source, top, facts.owns_stage, problems);
  facts.truth = top.boolean("truth", true);
  if (facts.owns_stage && facts.truth)
    top.complain(top.has("truth") ? "truth" : "",
                 "a scene that owns its stage has no ground truth; expected \"truth\": false");

  if (top.get("own_optimum")) {
    const std::string how = top.string("own_optimum", "");
    facts.searches_optimum = how == "searched";
    if (!facts.searches_optimum)
      top.complain("own_optimum", "expected \"searched\", or no 'own_optimum'; found '" + how + "'");
    else if (!facts.truth)
      top.complain("own_optimum", "a search needs the ground truth, which this scene has not");
  }

  facts.nominal_pose =
      top.numbers("nominal_pose", facts.axes.size(),
                  facts.owns_stage ? std::vector<double>(facts.axes.size(), 0.5) : std::vector<double>{});
  if (!top.has("nominal_pose") && !facts.owns_stage) top.complain_missing("nominal_pose", "one number per axis");
  for (const double value : facts.nominal_pose)
    if (!(value >= 0 && value <= 1)) top.complain("nominal_pose", "every value must be from 0 to 1");

  facts.readings = read_readings(source, top, problems);
  if (top.has("image")) {
    constexpr std::int64_t largest_side = 20000;
    ObjectReader image(source, "/image", problems);
    for (const char* side : {"width", "height"})
      if (!image.has(side)) image.complain_missing(side, "pixels");
    facts.image_width = static_cast<unsigned>(image.integer("width", 1, 1, largest_side));
    facts.image_height = static_cast<unsigned>(image.integer("height", 1, 1, largest_side));
    facts.image_white = image.number("white", 1, 1e-12, 1e12);
    image.reject_unknown();
    if (facts.readings.size() > facts.image_width)
      top.complain("readings", "expected at most as many readings as the image has columns, " +
                                   std::to_string(facts.image_width) + "; found " +
                                   std::to_string(facts.readings.size()));
  } else if (!facts.readings.empty()) {
    facts.image_width = static_cast<unsigned>(facts.readings.size());
  } else {
    top.complain_missing("image", "{\"width\": ..., \"height\": ..., \"white\": ...}, or \"readings\": [...]");
  }
  const std::size_t pixels = std::size_t{facts.image_width} * facts.image_height;

  facts.pitch_um = top.number("pitch_um", 0, 1e-6, 1e6);
  if (top.get("fields"))
    facts.fields = images::read_edge_fields(source, "/fields", facts.image_width, facts.image_height, problems);
  if (!facts.readings.empty()) ++facts.image_height;  // the line of readings

  facts.elements = read_texts(top, "elements", !facts.owns_stage);
  for (auto name = facts.elements.begin(); name != facts.elements.end(); ++name)
    if (std::find(facts.elements.begin(), name, *name) != name)
      top.complain("elements", "duplicate element '" + *name + "'");
  facts.uncertain = read_uncertain(source, top, facts.elements, problems);
  if (top.get("score")) {
    facts.score = read_scene_score(source, {facts.readings, pixels}, facts.score_measure, problems);
  } else if (!facts.readings.empty()) {
    top.complain_missing("score", R"({"name": ..., "unit": ..., "resolution": ..., "reading": ...})");
  }
  facts.files = read_texts(top, "files", false);
  if (top.get("machine_time"))
    facts.machine_time = changed_by(read_machine_time(source, "/machine_time", problems), facts.machine_time);
  if (const Json* spec = top.get("spec"); spec && !spec->is_null()) {
    check_specification(source, "/spec", problems);
    facts.spec = *spec;
  }
  throw_if_any(problems);
  return facts;
}

struct Overlap {
  images::Region region{};
  double pixels = 0;
};

Overlap overlap_of(const images::Region& one, const images::Region& other) {
  Overlap overlap;
  const std::size_t left = std::max(one.x, other.x), top = std::max(one.y, other.y);
  const std::size_t right = std::min(one.x + one.width, other.x + other.width);
  const std::size_t bottom = std::min(one.y + one.height, other.y + other.height);
  if (right <= left || bottom <= top) return overlap;
  overlap.region = {left, top, right - left, bottom - top};
  overlap.pixels = static_cast<double>(overlap.region.width) * static_cast<double>(overlap.region.height);
  return overlap;
}

images::Region as_region(const PixelRegion& region) { return {region.column, region.row, region.columns, region.rows}; }

// A box around a mark, cut at the image's upper and left border.
images::Region around(const images::Mark& mark) {
  const auto from = [&](double centre) { return static_cast<std::size_t>(std::max(0.0, centre - mark.side_px / 2)); };
  const auto side = static_cast<std::size_t>(mark.side_px);
  return {from(mark.x_px), from(mark.y_px), side, side};
}

}  // namespace

void show_regions(const PixelRegions& regions, const images::EdgeFields& fields, images::EdgeFields& shown) {
  constexpr images::Region kNothing{0, 0, 1, 1};  // too small for any edge
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const images::EdgeField& field = fields[i];
    const auto is_read = [&](const images::Region& edge) {
      return std::any_of(regions.begin(), regions.end(), [&](const PixelRegion& region) {
        return overlap_of(edge, as_region(region)).pixels == overlap_of(edge, edge).pixels;
      });
    };
    shown[i].tangential = field.tangential;
    shown[i].sagittal = field.sagittal;
    if (!field.mark) {
      if (field.tangential && !is_read(*field.tangential)) shown[i].tangential.reset();
      if (field.sagittal && !is_read(*field.sagittal)) shown[i].sagittal.reset();
      continue;
    }
    shown[i].window = kNothing;
    double most = 0;
    for (const PixelRegion& region : regions) {
      const Overlap read = field.window ? overlap_of(as_region(region), *field.window)
                                        : overlap_of(as_region(region), as_region(region));
      const double pixels = overlap_of(read.region, around(*field.mark)).pixels;
      if (pixels > most) most = pixels, shown[i].window = read.region;
    }
  }
}

MachineTime changed_by(const MachineTimeKeys& given, MachineTime times) {
  times.speed_mm_per_s = given.speed_mm_per_s.value_or(times.speed_mm_per_s);
  times.speed_deg_per_s = given.speed_deg_per_s.value_or(times.speed_deg_per_s);
  times.settle_ms = given.settle_ms.value_or(times.settle_ms);
  times.exposure_ms = given.exposure_ms.value_or(times.exposure_ms);
  times.readout_ms = given.readout_ms.value_or(times.readout_ms);
  return times;
}

images::Image picture_of(const SceneFacts& facts, const float* capture) {
  images::Image picture(facts.image_width, facts.picture_height());
  std::copy_n(capture, picture.values.size(), picture.values.begin());
  return picture;
}

std::vector<std::size_t> SceneFacts::observable_axes() const {
  std::vector<std::size_t> observable;
  for (std::size_t i = 0; i < axes.size(); ++i)
    if (axes[i].observable) observable.push_back(i);
  return observable;
}

double SceneFacts::measured(const float* pixels, const float* reference) const {
  const std::size_t count = std::size_t{image_width} * image_height;
  if (!score_measure) return images::rmse(pixels, reference, count);
  const bool all_finite = std::all_of(pixels, pixels + count, [](float value) { return std::isfinite(value); });
  return all_finite ? double{pixels[*score_measure]} : std::numeric_limits<double>::quiet_NaN();
}

SceneFacts read_scene_facts(const std::string& description, const std::string& scene_id) {
  try {
    return read(JsonSource::from_text(description, "description"));
  } catch (const Error& error) {
    throw Error(ErrorKind::plugin_failed, "scene '" + scene_id + "' has an unusable description:\n" + error.what());
  }
}

}  // namespace relign::trials
