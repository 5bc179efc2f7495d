// Training cost and its break-even point.
#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/aggregate_data.h"
#include "report/page_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

std::string duration(const Json& hours) {
  if (!hours.is_number()) return "-";
  const double value = hours.get<double>();
  return value < 1 ? significant(60 * value, 2) + " min" : significant(value, 3) + " h";
}

std::string lenses_text(double lenses) {
  return significant(rounded(lenses, 3), 3) + (lenses == 1 ? " lens" : " lenses");
}

// One line per group with a specification.
void break_even(HtmlWriter& html, const Json& entry, bool labelled) {
  const Json& list = list_of(entry, "pays_after");
  if (list.empty()) {
    html.text("-");
    return;
  }
  for (const Json& group : list) {
    html.open("div");
    if (labelled) html.element("bdi", text_of(group, "label")).text(": ");
    const Json lenses = group.value("lenses", Json());
    const std::string against = text_of(group, "against");
    if (lenses.is_number())
      html.element("b", lenses_text(lenses.get<double>()));
    else
      html.element("b", lenses.is_string() ? lenses.get<std::string>() : "unknown");
    if (lenses.is_number())
      html.text(": saves " + number_text(group.value("saves", Json()), 2) + " s per lens over ")
          .element("bdi", against);
    else if (lenses.is_string() && against.empty())
      html.text(": fewer than half of the instances reach the specification");
    else if (lenses.is_string())
      html.text(": no faster than ").element("bdi", against);
    else if (against.empty())
      html.text(": no method without training reaches the specification on half of the instances");
    html.close();
  }
}

}  // namespace

std::string training_section(const Json& data) {
  const Json& training = list_of(data, "training");
  if (training.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Training cost").open("div", {{"class", "scroll"}});
  html.open("table", {{"class", "sortable training"}}).open("thead").open("tr");
  for (const char* title : {"method", "training time", "training images", "machine", "break-even after"})
    html.open("th", {{"scope", "col"}}).element("span", {{"class", "title"}}, title).close();
  html.close().close().open("tbody");
  for (const Json& entry : training) {
    const Json hours = entry.value("hours", Json()), steps = entry.value("steps", Json());
    const Json& groups = list_of(entry, "pays_after");
    html.open("tr").open("th", {{"scope", "row"}, {"data-sort", text_of(entry, "method")}});
    html.element("bdi", text_of(entry, "method"));
    if (const std::string tag = training_tag(data, text_of(entry, "method")); !tag.empty())
      html.text(" ").element("span", {{"class", "tag"}}, tag);
    html.close();
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(hours)}}, duration(hours));
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(steps)}}, number_text(steps, 6));
    const std::string machine = text_of(entry, "machine");
    html.element("td", {{"data-sort", machine}}, machine.empty() ? "-" : machine);
    html.open("td", {{"class", "words"},
                     {"data-sort", groups.empty() ? "" : sort_value(groups.front().value("lenses", Json()))}});
    break_even(html, entry, data["groups"].size() > 1);
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
