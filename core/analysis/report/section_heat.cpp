// Heat map of methods by groups: yields, or errors where the matrix of excess errors (section_matrix.cpp) lacks a
// group. Each cell links to the card of its group.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/matrix_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

// Limits of the shades 0 (best) to 4: of the error relative to the best of the column, or of the yield.
constexpr double kFactors[] = {1.1, 1.5, 2.5, 5};
constexpr double kYields[] = {0.95, 0.8, 0.5, 0.2};

struct Cell {
  std::string text, title;
  int shade = -1;  // none
};

Cell yield_cell(const Row& row) {
  if (!row.yield) return {};
  Cell cell;
  const double share = row.yield->share;
  cell.text = whole_percent(share);
  cell.shade =
      static_cast<int>(std::count_if(std::begin(kYields), std::end(kYields), [&](double y) { return share < y; }));
  const statistics::Interval& interval = row.yield->interval;
  cell.title = interval_text({100 * interval.low, 100 * interval.high}, 3, " to ") + " % (95 % interval)";
  return cell;
}

Cell error_cell(const Row& row, double best) {
  const Score& error = row.score();
  if (error.n == 0) return {};
  Cell cell;
  cell.text = number_text(error.median, 3);
  const double factor = best > 0 ? error.median / best : 1;
  cell.shade =
      static_cast<int>(std::count_if(std::begin(kFactors), std::end(kFactors), [&](double f) { return factor > f; }));
  cell.title = error.interval.exists() ? interval_text(error.interval, 3, " to ") + " (95 % interval)"
                                       : interval_text({error.q25, error.q75}, 3, " to ") + " (quartiles)";
  return cell;
}

double best_of(const Group& group) {
  double best = 0;
  for (const Row& row : group.rows) {
    const double median = row.score().median;
    if (!row.oracle() && median > 0 && (best == 0 || median < best)) best = median;
  }
  return best;
}

void heat_head(HtmlWriter& html, const PageModel& page) {
  html.open("thead").open("tr").element("th", {{"scope", "col"}, {"class", "name"}}, "method");
  std::size_t index = 0;
  for (const Group& group : page.groups)
    html.open("th", {{"scope", "col"}, {"class", "number"}})
        .open("a", {{"href", "#group-" + std::to_string(index++)}})
        .element("bdi", group.label)
        .close()
        .close();
  html.close().close();
}

}  // namespace

std::string heat_section(const PageModel& page) {
  if (page.groups.size() < 2 || page.methods.size() < 2) return "";
  const bool by_yield = any_row(page, &Row::yield);
  const Matrix matrix = matrix_of(page);
  if (!by_yield && has_matrix(matrix) && matrix.domains == page.groups.size()) return "";
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
  heat_head(html, page);
  html.open("tbody");
  std::vector<std::map<std::string, const Row*>> rows;
  std::vector<double> best;
  for (const Group& group : page.groups) {
    rows.emplace_back();
    for (const Row& row : group.rows) rows.back()[row.method] = &row;
    best.push_back(best_of(group));
  }
  for (const Method& method : page.methods) {
    html.open("tr").open("th", {{"scope", "row"}, {"class", "name"}}).element("bdi", method.label);
    tag(html, method.training_tag);
    html.close();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto row = rows[i].find(method.name);
      const bool here = row != rows[i].end() && page.groups[i].protocol == method.protocol;
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
