#include "imaging/imaging_errors.h"

#include "base/schema.h"
#include "base/text.h"

extern "C" {
extern const unsigned char relign_schema_imaging_errors[];
extern const unsigned long relign_schema_imaging_errors_size;
}

namespace relign::imaging {
namespace {

// Reads values that are a number or a range [low, high].
class RangeReader {
 public:
  RangeReader(const JsonSource& source, std::vector<Problem>& problems) : source_(source), problems_(problems) {}

  void read(const Json& object, const std::string& pointer, const char* key, Range& range) {
    const auto value = object.find(key);
    if (value == object.end()) return;
    range = value->is_array() ? Range{value->at(0), value->at(1)} : Range{*value, *value};
    if (range.low > range.high)
      problems_.push_back(source_.problem(
          pointer + "/" + key,
          "expected a range [low, high], found " + shortest(range.low) + " above " + shortest(range.high)));
  }

 private:
  const JsonSource& source_;
  std::vector<Problem>& problems_;
};

}  // namespace

ImagingErrors read_imaging_errors(const JsonSource& source) {
  static const Schema schema(relign_schema_imaging_errors, relign_schema_imaging_errors_size);
  std::vector<Problem> problems;
  const Json file = schema.checked(source, problems);
  RangeReader ranges(source, problems);
  ImagingErrors errors;
  errors.each_capture = file["drawn"] == "capture";
  errors.seed = file["seed"];
  errors.share = file["share"];
  errors.error_share = file["error_share"];
  if (const auto target = file.find("target"); target != file.end()) {
    TargetErrors& read = errors.target.emplace();
    for (const auto& [key, range] :
         {std::pair{"scale", &read.scale}, {"shift", &read.shift}, {"rotation_deg", &read.rotation_deg}})
      ranges.read(*target, "/target", key, *range);
  }
  if (const auto stray = file.find("stray_light"); stray != file.end()) {
    StrayLightErrors& read = errors.stray_light.emplace();
    for (const auto& [key, range] : {std::pair{"mean", &read.mean},
                                     {"blob_radius", &read.blob_radius},
                                     {"blobs", &read.blobs},
                                     {"gradient", &read.gradient},
                                     {"rings", &read.rings},
                                     {"arcs", &read.arcs},
                                     {"ring_share", &read.ring_share}})
      ranges.read(*stray, "/stray_light", key, *range);
  }
  Range full_scale;
  for (const auto& [key, range] : {std::pair{"vignetting", &errors.vignetting},
                                   {"blur_px", &errors.blur_px},
                                   {"photon", &errors.photon},
                                   {"pixel_gain", &errors.pixel_gain},
                                   {"gain", &errors.gain},
                                   {"gamma", &errors.gamma},
                                   {"pixel_offset", &errors.pixel_offset},
                                   {"offset", &errors.offset},
                                   {"read_noise", &errors.read_noise},
                                   {"hot_pixels", &errors.hot_pixels},
                                   {"bits", &errors.bits},
                                   {"full_scale", &full_scale}})
    ranges.read(file, "", key, *range);
  if (file.contains("full_scale")) errors.full_scale = full_scale;
  if (errors.bits.low < 1 && errors.bits.high > 0)
    problems.push_back(source.problem("/bits", "expected 0 (not rounded), or a range from 1 to 16"));
  if (errors.has_full_scale() != errors.full_scale.has_value() && problems.empty())
    problems.push_back(
        errors.full_scale
            ? source.problem("/full_scale", "has no effect without 'bits' or 'hot_pixels'; add one or remove it")
            : source.problem("", "missing key 'full_scale' (white 1; needed by 'bits' and 'hot_pixels')"));
  throw_if_any(problems);
  return errors;
}

ImagingErrors read_imaging_errors(const std::filesystem::path& file) {
  return read_imaging_errors(JsonSource::from_file(file));
}

}  // namespace relign::imaging
