// Yield and moves to specification over the noise levels.
#include "markup/html_writer.h"
#include "report/figure_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxLevelMethods = 10;  // more bars are indistinguishable

// Series are in ranking order.
void keep_the_best(Figure& figure) {
  const std::size_t all = figure.chart.series.size();
  if (all <= kMaxLevelMethods) return;
  figure.chart.series.resize(kMaxLevelMethods);
  figure.caption +=
      " First " + std::to_string(kMaxLevelMethods) + " of " + std::to_string(all) + " methods; the ranking lists all.";
}

}  // namespace

std::string levels_section(const PageModel& page) {
  std::vector<Figure> figures = level_figures(page);
  if (figures.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Yield and moves to specification").open("div", {{"class", "figures"}});
  bool any = false;
  for (Figure& figure : figures) {
    if (figure.chart.x.categories.size() < 2) continue;  // the ranking shows a single level
    keep_the_best(figure);
    figure_html(html, figure, true);
    any = true;
  }
  return any ? html.take() : "";
}

}  // namespace relign::report
