// Moves and seconds to each criterion of the specification, and to all of them.
#include <algorithm>
#include <cmath>
#include <string>

#include "markup/html_writer.h"
#include "report/sections.h"
#include "report/spec_words.h"

namespace relign::report {
namespace {

void arrival_cell(HtmlWriter& html, double median, const statistics::Interval& interval) {
  if (!std::isfinite(median))
    return interval_cell(html, "number quiet", "", std::isinf(median) ? "not reached" : "-", "");
  std::string text;
  if (std::isfinite(interval.low))
    text = number_text(interval.low, 3) +
           (std::isfinite(interval.high) ? "\u2013" + number_text(interval.high, 3) : " or more");
  interval_cell(html, "number", sort_value(median), number_text(median, 3), text);
}

}  // namespace

std::string specification_section(const PageModel& page) {
  const auto judged = [](const Row& row) { return !row.to_specification.empty(); };
  if (!any_row(page, judged)) return "";
  HtmlWriter html;
  html.element("h3", "To specification");
  html.element(
      "p", {{"class", "facts"}},
      "Each criterion is judged noise-free after every image, where the recommended pose leaves the lens; 'all' at "
      "one image. Position and tilt are distances from the instance's own optimum over the observable axes. In "
      "spec: at the end. Each move ends with one image; the image at the start does not count. Medians with 95 % "
      "intervals; 'not reached': by fewer than half of the instances.");
  for (const Group& group : page.groups) {
    if (std::none_of(group.rows.begin(), group.rows.end(), judged)) continue;
    html.open("div", {{"class", "scroll"}}).open("table", {{"class", "sortable"}});
    html.element("caption", group.label);
    table_head(html, {"method", "criterion", "in spec", "moves to spec", "time to spec, s"});
    html.open("tbody");
    for (const Row& row : group.rows)
      for (const CriterionScore& score : row.to_specification) {
        html.open("tr");
        method_cell(html, row.method, row.oracle(), row.training_tag);
        html.element("td", criterion_words(score.name, group.spec));
        interval_cell(html, "number", sort_value(score.share.share), whole_percent(score.share.share) + " %",
                      whole_percent(score.share.interval.low) + "\u2013" + whole_percent(score.share.interval.high));
        arrival_cell(html, score.time.steps, score.time.interval);
        arrival_cell(html, score.time.seconds, score.seconds);
        html.close();
      }
    html.close().close().close();
  }
  return html.take();
}

}  // namespace relign::report
