// The measures of pixels/measures.h and registration.h by name, with arguments as JSON: what the service
// "relign.measures/1" offers.
#pragma once

#include <string>

#include "base/json_source.h"
#include "images/measures.h"

namespace relign::trials {

// [{"name": ..., "summary": ..., "arguments": {name: meaning}}, ...]
Json list_measures();

// Of an image; some compare it with the reference image. NaN when the image does not allow it. Throws Error(bad_input)
// for an unknown measure or wrong arguments; empty text stands for no arguments.
double measure(const images::View& image, const images::View& reference, const std::string& name,
               const std::string& arguments_json);

}  // namespace relign::trials
