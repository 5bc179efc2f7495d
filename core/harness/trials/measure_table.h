// The measures of images/measures.h and images/registration.h by name, with arguments as JSON, for the service
// "relign.measures/1".
#pragma once

#include <relign/plugin.h>

#include <string>
#include <vector>

#include "base/json_source.h"
#include "images/measures.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// [{"name": ..., "summary": ..., "arguments": {name: meaning}}, ...]
Json list_measures();

// Computes a measure of an image of the scene; some compare it with the reference image. NaN where it is undefined for
// the image. Empty `arguments_json`: no arguments. Throws Error(bad_input) for an unknown measure or wrong arguments.
double measure(const images::View& image, const images::View& reference, const SceneFacts& scene,
               const std::string& name, const std::string& arguments_json);

// The frequency of {"cycles_per_pixel": ...} or {"lp_per_mm": ...}, for the fields of a scene. Throws Error(bad_input)
// for other arguments and for a scene without fields.
double cycles_per_pixel_of(const SceneFacts& scene, const std::string& arguments_json);

// All fields of an image at once.
class FieldMeasures {
 public:
  // As field_mtf, without "field" and "direction". `scene` must outlive it. Throws Error(bad_input) for wrong
  // arguments.
  FieldMeasures(const images::View& image, const SceneFacts& scene, const std::string& arguments_json);
  FieldMeasures() = default;
  // Writes pointers into this object, up to the struct_size of `fields`. Throws Error(bad_input) if that is too small.
  void write(relign_field_measures* fields) const;

 private:
  std::vector<relign_text> names_;
  std::vector<double> mark_x_px_, mark_y_px_, tangential_, sagittal_;
};

}  // namespace relign::trials
