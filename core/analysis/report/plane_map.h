// The error over two axes as a colour map.
#pragma once

#include "markup/html_writer.h"
#include "report/page_model.h"

namespace relign::report {

// Colours are viridis, dark is low; they stay distinguishable in greyscale.
void plane_map(HtmlWriter& html, const LandscapePlane& plane);

}  // namespace relign::report
