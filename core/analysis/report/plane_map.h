// The error over two axes as a colour map.
#pragma once

#include "base/json_source.h"
#include "markup/html_writer.h"

namespace relign::report {

// `plane` as in scene_data.h. Colours are viridis, dark is low; they stay distinguishable in greyscale.
void plane_map(HtmlWriter& html, const Json& plane);

}  // namespace relign::report
