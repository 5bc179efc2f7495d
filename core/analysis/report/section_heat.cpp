// Heat map of methods by groups. Each cell links to the card of its group.
#include <algorithm>
#include <cmath>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/page_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

// Limits of the shades 0 (best) to 4: of the error relative to the best of the column, or of the yield.
constexpr double kFactors[] = {1.1, 1.5, 2.5, 5};
constexpr double kYields[] = {0.95, 0.8, 0.5, 0.2};

bool has_number(const Json& object, const char* key) {
  return object.is_object() && object.contains(key) && object[key].is_number();
}

struct Cell {
  std::string text, title;
  int shade = -1;  // none
};

Cell yield_cell(const Json& row) {
  Cell cell;
  const Json& yield = object_of(row, "yield");
  if (!has_number(yield, "share")) return cell;
  const double share = yield["share"].get<double>();
  cell.text = std::to_string(std::lround(100 * share));
  cell.shade =
      static_cast<int>(std::count_if(std::begin(kYields), std::end(kYields), [&](double y) { return share < y; }));
  if (has_number(yield, "lo95") && has_number(yield, "hi95"))
    cell.title = significant(100 * yield["lo95"].get<double>(), 3) + " to " +
                 significant(100 * yield["hi95"].get<double>(), 3) + " % (95 % interval)";
  return cell;
}

Cell error_cell(const Json& row, double best) {
  Cell cell;
  const Json& error = score_of(row);
  if (!has_number(error, "median")) return cell;
  const double median = error["median"].get<double>();
  cell.text = significant(median, 3);
  const double factor = best > 0 ? median / best : 1;
  cell.shade =
      static_cast<int>(std::count_if(std::begin(kFactors), std::end(kFactors), [&](double f) { return factor > f; }));
  const bool interval = has_number(error, "lo95") && has_number(error, "hi95");
  cell.title = number_text(error[interval ? "lo95" : "q25"], 3) + " to " +
               number_text(error[interval ? "hi95" : "q75"], 3) + (interval ? " (95 % interval)" : " (quartiles)");
  return cell;
}

double best_of(const Json& group) {
  double best = 0;
  for (const Json& row : group["rows"])
    if (has_number(score_of(row), "median") && !flag_of(row, "oracle")) {
      const double median = score_of(row)["median"].get<double>();
      if (median > 0 && (best == 0 || median < best)) best = median;
    }
  return best;
}

void heat_head(HtmlWriter& html, const Json& data) {
  html.open("thead").open("tr").element("th", {{"scope", "col"}, {"class", "name"}}, "method");
  std::size_t index = 0;
  for (const Json& group : data["groups"])
    html.open("th", {{"scope", "col"}, {"class", "number"}})
        .open("a", {{"href", "#group-" + std::to_string(index++)}})
        .element("bdi", text_of(group, "label"))
        .close()
        .close();
  html.close().close();
}

}  // namespace

std::string heat_section(const Json& data) {
  if (data["groups"].size() < 2 || data["methods"].size() < 2) return "";
  const bool by_yield = any_row(data, "yield");
  HtmlWriter html;
  html.element("h2", "Methods by scene and noise level");
  html.element(
      "p", {{"class", "quiet"}},
      by_yield
          ? "Instances in specification, %. Strong colours: nearly all; faint: few. Tooltips show intervals; cells "
            "link to the curves."
          : "Median error. Strong colours: within 10 % of the best of the column; faint: more than five times the "
            "best. Tooltips show intervals; cells link to the curves.");
  html.open("div", {{"class", "scroll"}}).open("table", {{"class", "heat"}});
  heat_head(html, data);
  html.open("tbody");
  std::vector<std::map<std::string, const Json*>> rows;
  std::vector<double> best;
  for (const Json& group : data["groups"]) {
    rows.emplace_back();
    for (const Json& row : group["rows"]) rows.back()[text_of(row, "method")] = &row;
    best.push_back(best_of(group));
  }
  for (const Json& method : data["methods"]) {
    const std::string name = text_of(method, "name"), protocol = text_of(method, "protocol");
    html.open("tr").open("th", {{"scope", "row"}, {"class", "name"}}).element("bdi", text_of(method, "label"));
    if (const std::string tag = text_of(method, "training_tag"); !tag.empty())
      html.text(" ").element("span", {{"class", "tag"}}, tag);
    html.close();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto row = rows[i].find(name);
      const bool here = row != rows[i].end() && text_of(data["groups"][i], "protocol") == protocol;
      const Cell cell = !here ? Cell{} : by_yield ? yield_cell(*row->second) : error_cell(*row->second, best[i]);
      if (cell.shade < 0) {
        html.element("td", "");
        continue;
      }
      html.open("td", {{"class", "h" + std::to_string(cell.shade)}, {"title", cell.title}});
      html.element("a", {{"href", "#group-" + std::to_string(i)}}, cell.text).close();
    }
    html.close();
  }
  return html.take();
}

}  // namespace relign::report
