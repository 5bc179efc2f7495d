#include "imaging/imaging_errors.h"

#include <cmath>
#include <string>
#include <vector>

#include "base/text.h"

namespace relign::imaging {
namespace {

// Reads values of one object: a number, or a range [low, high].
class RangeReader {
 public:
  RangeReader(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems)
      : object(source, pointer, problems) {}

  void read(const char* key, double minimum, double maximum, Range& range) {
    take(key, minimum, maximum, false, range);
  }
  void read_integer(const char* key, double maximum, Range& range) { take(key, 0, maximum, true, range); }

  ObjectReader object;

 private:
  void take(const char* key, double minimum, double maximum, bool integer, Range& range) {
    const Json* value = object.get(key);
    if (!value) return;
    const bool pair = value->is_array() && value->size() == 2;
    const Json& low = pair ? value->at(0) : *value;
    const Json& high = pair ? value->at(1) : *value;
    const auto fits = [&](const Json& one) {
      if (!one.is_number()) return false;
      const auto number = one.get<double>();
      return number >= minimum && number <= maximum && (!integer || number == std::floor(number));
    };
    if (!fits(low) || !fits(high)) {
      object.complain(key, std::string("expected ") + (integer ? "an integer" : "a number") + " from " +
                               shortest(minimum) + " to " + shortest(maximum) +
                               ", or a range of two [low, high], found " +
                               value->dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 60));
      return;
    }
    range = {low.get<double>(), high.get<double>()};
    if (range.low > range.high)
      object.complain(key,
                      "expected a range [low, high], found " + shortest(range.low) + " above " + shortest(range.high));
  }
};

StrayLightErrors read_stray_light(const JsonSource& source, const std::string& at, std::vector<Problem>& problems) {
  RangeReader reader(source, at, problems);
  StrayLightErrors stray;
  if (!reader.object.get("mean")) reader.object.complain_missing("mean", "number or range");
  reader.read("mean", 0, 10, stray.mean);
  reader.read("blob_radius", 0.05, 5, stray.blob_radius);
  reader.read_integer("blobs", 16, stray.blobs);
  reader.read("gradient", 0, 100, stray.gradient);
  reader.read_integer("rings", 16, stray.rings);
  reader.read_integer("arcs", 16, stray.arcs);
  reader.read("ring_share", 0, 1, stray.ring_share);
  reader.object.reject_unknown();
  return stray;
}

TargetErrors read_target(const JsonSource& source, const std::string& at, std::vector<Problem>& problems) {
  RangeReader reader(source, at, problems);
  TargetErrors target;
  reader.read("scale", 0.5, 2, target.scale);
  reader.read("shift", -0.5, 0.5, target.shift);
  reader.read("rotation_deg", -180, 180, target.rotation_deg);
  reader.object.reject_unknown();
  return target;
}

}  // namespace

ImagingErrors read_imaging_errors(const JsonSource& source) {
  std::vector<Problem> problems;
  RangeReader reader(source, "", problems);
  ObjectReader& top = reader.object;
  ImagingErrors errors;
  top.integer("format", 1, 1, 1);
  const std::string drawn = top.string("drawn", "scene");
  if (drawn != "scene" && drawn != "capture") top.complain("drawn", "found '" + drawn + "'; allowed: scene, capture");
  errors.each_capture = drawn == "capture";
  errors.seed = static_cast<std::uint64_t>(top.integer("seed", 0, 0, INT64_MAX));
  errors.share = top.number("share", 1, 0, 1);
  errors.error_share = top.number("error_share", 1, 0, 1);
  if (top.get("target")) errors.target = read_target(source, "/target", problems);
  reader.read("vignetting", 0, 1, errors.vignetting);
  if (top.get("stray_light")) errors.stray_light = read_stray_light(source, "/stray_light", problems);
  reader.read("blur_px", 0, 20, errors.blur_px);
  reader.read("photon", 0, 100, errors.photon);
  reader.read("pixel_gain", 0, 1, errors.pixel_gain);
  reader.read("gain", 0.01, 100, errors.gain);
  reader.read("gamma", 0.1, 10, errors.gamma);
  reader.read("pixel_offset", 0, 10, errors.pixel_offset);
  reader.read("offset", -10, 10, errors.offset);
  reader.read("read_noise", 0, 10, errors.read_noise);
  reader.read("hot_pixels", 0, 1, errors.hot_pixels);
  reader.read_integer("bits", 16, errors.bits);
  if (top.get("full_scale")) {
    Range full_scale;
    reader.read("full_scale", 0.01, 1000, full_scale);
    errors.full_scale = full_scale;
  }
  if (errors.bits.low < 1 && errors.bits.high > 0)
    top.complain("bits", "expected 0 (not rounded), or a range from 1 to 16");
  if (errors.has_full_scale() != errors.full_scale.has_value() && problems.empty()) {
    if (errors.full_scale)
      top.complain("full_scale", "has no effect without 'bits' or 'hot_pixels'; add one or remove it");
    else
      top.complain_missing("full_scale", "white 1; needed by 'bits' and 'hot_pixels'");
  }
  top.reject_unknown();
  throw_if_any(problems);
  return errors;
}

ImagingErrors read_imaging_errors(const std::filesystem::path& file) {
  return read_imaging_errors(JsonSource::from_file(file));
}

}  // namespace relign::imaging
