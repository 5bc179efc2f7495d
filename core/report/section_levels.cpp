// How yield and images to spec change with the noise level.
#include "report/figure_html.h"
#include "report/html_writer.h"
#include "report/sections.h"

namespace relign::report {

std::string levels_section(const Json& data) {
  const std::vector<Figure> figures = level_figures(data);
  if (figures.empty()) return "";
  HtmlWriter html;
  html.element("h2", "In spec, and how soon").open("div", {{"class", "figures"}});
  bool any = false;
  for (const Figure& figure : figures) {
    if (figure.chart.x.categories.size() < 2) continue;  // a single level stands in the ranking
    figure_html(html, figure, true);
    any = true;
  }
  return any ? html.take() : "";
}

}  // namespace relign::report
