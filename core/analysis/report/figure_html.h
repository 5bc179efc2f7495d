// A static figure in the page: a chart and its caption.
#pragma once

#include "markup/html_writer.h"
#include "report/figures.h"

namespace relign::report {

// `titled`: with the chart's title as a heading.
void figure_html(HtmlWriter& html, const Figure& figure, bool titled);

}  // namespace relign::report
