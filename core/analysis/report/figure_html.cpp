#include "report/figure_html.h"

#include <algorithm>

namespace relign::report {
namespace {

constexpr double kTallest = 400;  // on the page, where labels may be omitted; figures for papers have all

}  // namespace

void figure_html(HtmlWriter& html, const Figure& figure, bool titled) {
  html.open("figure", {{"class", "plot"}});
  if (titled) html.open("h3").element("bdi", figure.chart.title).close();
  Chart chart = figure.chart;
  chart.height = std::min(chart.height, kTallest);
  draw_chart(html, chart, ChartUse::in_page);
  html.element("figcaption", figure.caption).close();
}

}  // namespace relign::report
