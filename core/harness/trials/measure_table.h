// The measures of images/measures.h and images/registration.h by name, with arguments as JSON, for the service
// "relign.measures/1".
#pragma once

#include <string>

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

}  // namespace relign::trials
