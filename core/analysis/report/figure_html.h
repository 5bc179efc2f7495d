// A static figure inside the page: the chart, and below it what it shows.
#pragma once

#include "markup/html_writer.h"
#include "report/figures.h"

namespace relign::report {

// `titled`: with the chart's title above, where nothing else says what group it is.
void figure_html(HtmlWriter& html, const Figure& figure, bool titled);

}  // namespace relign::report
