// Training cost and its break-even point.
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/sections.h"

namespace relign::report {
namespace {

std::string duration(double hours) {
  if (!std::isfinite(hours)) return "-";
  return hours < 1 ? significant(60 * hours, 2) + " min" : significant(hours, 3) + " h";
}

std::string lenses_text(double lenses) {
  return significant(rounded(lenses, 3), 3) + (lenses == 1 ? " lens" : " lenses");
}

void break_even(HtmlWriter& html, const BreakEven& even) {
  const bool pays = std::isfinite(even.lenses), never = std::isinf(even.lenses);
  html.element("b", pays ? lenses_text(even.lenses) : never ? "never" : "unknown");
  if (pays)
    html.text(": saves " + number_text(even.saves, 2) + " s per lens over ").element("bdi", even.against);
  else if (never && even.against.empty())
    html.text(": fewer than half of the instances reach the specification");
  else if (never)
    html.text(": no faster than ").element("bdi", even.against);
  else if (even.against.empty())
    html.text(": no method without training reaches the specification on half of the instances");
}

void by_cost(HtmlWriter& html, const BreakEven& even, const statistics::Prices& prices) {
  html.text("; by cost, ")
      .element("b", std::isinf(even.modules) ? "never" : shortest(rounded(even.modules, 3)) + " good modules");
  html.text(" against ").element("bdi", prices.baseline);
}

}  // namespace

std::string training_section(const PageModel& page) {
  if (page.training.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Training cost").open("div", {{"class", "scroll"}});
  html.open("table", {{"class", "sortable training"}}).open("thead").open("tr");
  for (const char* title : {"method", "training time", "training images", "machine", "break-even after"})
    html.open("th", {{"scope", "col"}}).element("span", {{"class", "title"}}, title).close();
  html.close().close().open("tbody");
  for (const TrainingCost& cost : page.training) {
    html.open("tr").open("th", {{"scope", "row"}, {"data-sort", cost.method}}).element("bdi", cost.method);
    tag(html, training_tag(page.methods, cost.method));
    html.close();
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(cost.hours)}}, duration(cost.hours));
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(cost.steps)}},
                 cost.stated ? number_text(cost.steps, 6) : std::to_string(std::llround(cost.steps)));
    html.element("td", {{"data-sort", cost.machine}}, cost.machine.empty() ? "-" : cost.machine);
    html.open("td", {{"class", "words"},
                     {"data-sort", cost.pays_after.empty() ? "" : sort_value(cost.pays_after.front().lenses)}});
    if (cost.pays_after.empty()) html.text("-");
    for (const BreakEven& even : cost.pays_after) {  // one line per group with a specification
      html.open("div");
      if (page.groups.size() > 1) html.element("bdi", even.label).text(": ");
      break_even(html, even);
      if (!std::isnan(even.modules)) by_cost(html, even, page.groups[even.group].prices);
      html.close();
    }
    html.close().close();
  }
  html.close().close().close();
  html.element(
      "p", {{"class", "quiet"}},
      "Break-even: training time divided by the time that each lens saves until it is in specification (machine "
      "and compute time, medians), compared with the fastest method without training. The effort of developing "
      "the training is not included.");
  return html.take();
}

}  // namespace relign::report
