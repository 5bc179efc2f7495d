// How yield and images to spec change with the noise level.
#include "markup/html_writer.h"
#include "report/figure_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMostMethods = 10;  // bars of more cannot be told apart

// Rows stand best first, and so do the series.
void keep_the_best(Figure& figure) {
  const std::size_t all = figure.chart.series.size();
  if (all <= kMostMethods) return;
  figure.chart.series.resize(kMostMethods);
  figure.caption += " Shown are the first " + std::to_string(kMostMethods) + " of " + std::to_string(all) +
                    " methods; the ranking has all.";
}

}  // namespace

std::string levels_section(const Json& data) {
  std::vector<Figure> figures = level_figures(data);
  if (figures.empty()) return "";
  HtmlWriter html;
  html.element("h2", "In spec, and how soon").open("div", {{"class", "figures"}});
  bool any = false;
  for (Figure& figure : figures) {
    if (figure.chart.x.categories.size() < 2) continue;  // a single level stands in the ranking
    keep_the_best(figure);
    figure_html(html, figure, true);
    any = true;
  }
  return any ? html.take() : "";
}

}  // namespace relign::report
