// What learning beforehand has cost, and after how many lenses it pays.
#include "base/json_members.h"
#include "base/text.h"
#include "report/html_writer.h"
#include "report/sections.h"

namespace relign::report {
namespace {

std::string duration(const Json& hours) {
  if (!hours.is_number()) return "-";
  const double value = hours.get<double>();
  return value < 1 ? significant(60 * value, 2) + " min" : significant(value, 3) + " h";
}

}  // namespace

std::string training_section(const Json& data) {
  const Json& training = list_of(data, "training");
  if (training.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Training beforehand").open("div", {{"class", "scroll"}}).open("table", {{"class", "sortable"}});
  html.open("thead").open("tr");
  for (const char* title : {"method", "trained for", "images", "on", "pays after"})
    html.open("th", {{"scope", "col"}}).element("span", {{"class", "title"}}, title).close();
  html.close().close().open("tbody");
  for (const Json& entry : training) {
    const Json hours = entry.value("hours", Json()), steps = entry.value("steps", Json()),
               pays = entry.value("pays_after", Json());
    html.open("tr").open("th", {{"scope", "row"}, {"data-sort", text_of(entry, "method")}});
    html.element("bdi", text_of(entry, "method")).close();
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(hours)}}, duration(hours));
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(steps)}}, number_text(steps, 6));
    html.element("td", {{"data-sort", text_of(entry, "machine")}}, text_of(entry, "machine"));
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(pays)}},
                 pays.is_number()   ? number_text(pays, 3) + " lenses"
                 : pays.is_string() ? pays.get<std::string>()
                                    : "-");
    html.close();
  }
  return html.take();
}

}  // namespace relign::report
