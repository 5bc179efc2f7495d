// The error over two axes as a coloured map.
#pragma once

#include "base/json_source.h"
#include "markup/html_writer.h"

namespace relign::report {

// `plane` as scene_data.h has it. Dark is low; the colours are viridis, which tells them apart also in grey.
void plane_map(HtmlWriter& html, const Json& plane);

}  // namespace relign::report
