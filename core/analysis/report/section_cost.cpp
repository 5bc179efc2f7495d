// What a good module costs with each method, by the prices of the suite.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"
#include "markup/escape.h"
#include "markup/html_writer.h"
#include "report/cost_text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr const char* kUntil = "\u2013";

using statistics::Band;
using statistics::CostStudy;

void band_cell(HtmlWriter& html, const Band& band, int digits, double scale = 1, const std::string& unit = "") {
  if (band.n == 0) return interval_cell(html, "number quiet", "", "-", "");
  if (!std::isfinite(band.estimate)) return interval_cell(html, "number quiet", "", "no good module", "");
  std::string text;
  if (std::isfinite(band.interval.low)) {
    const char* const until = band.interval.low < 0 ? " to " : kUntil;  // a minus sign after a dash is hard to read
    text = number_text(scale * band.interval.low, digits) +
           (std::isfinite(band.interval.high) ? until + number_text(scale * band.interval.high, digits) : " or more");
  }
  interval_cell(html, "number", sort_value(scale * band.estimate), number_text(scale * band.estimate, digits) + unit,
                text);
}

// What the row of the budget does not show already.
bool is_shown(const CostStudy& cost, const CostStudy& budget) {
  return &cost == &budget || cost.steps != budget.steps ||
         (cost.saves.n > 0 && cost.saves.estimate != budget.saves.estimate);
}

void cost_row(HtmlWriter& html, const Row& row, const CostStudy& cost, bool cheapest, bool saves) {
  html.open("tr");
  method_cell(html, row.method, row.oracle(), row.training_tag);
  html.open("td", {{"class", "number"}, {"data-sort", std::to_string(cost.steps[0])}}).text(images_of(cost));
  tag(html, cheapest ? "chosen for least cost" : "");
  html.close();
  band_cell(html, cost.met, 3, 100, " %");
  band_cell(html, cost.seconds, 3);
  band_cell(html, cost.good_per_hour, 4);
  band_cell(html, cost.scrapped, 3, 1000);
  band_cell(html, cost.per_good_module, 3);
  if (saves) band_cell(html, cost.saves, 2);
  html.close();
}

}  // namespace

std::string images_of(const CostStudy& cost) {
  const std::string first = std::to_string(cost.steps[0] + 1);
  return cost.steps[0] == cost.steps[1] ? first : first + " / " + std::to_string(cost.steps[1] + 1);
}

std::string prices_sentence(const statistics::Prices& prices) {
  const auto price = [&](double value) {
    return shortest(rounded(value, 6)) + (prices.currency.empty() ? "" : " " + prices.currency);
  };
  std::string text =
      "Prices: station " + price(prices.station_per_hour) + " an hour, a scrapped module " + price(prices.module);
  if (!std::isnan(prices.rework))
    text +=
        ", rework " + price(prices.rework) + " (modules that miss are aligned once more, assumed to succeed as often)";
  return text + ".";
}

std::string cost_section(const PageModel& page) {
  const auto priced = [](const Row& row) { return !row.costs.empty(); };
  if (!any_row(page, priced)) return "";
  HtmlWriter html;
  html.element("h3", "Cost");
  html.element("p", {{"class", "facts"}},
               "A line that takes the same number of images of every module, the one at the start included, and then "
               "glues it where the method recommends. Station time is the whole cycle, mean. 'chosen for least cost': "
               "the number of images with which a good module costs least, chosen on one half of the instances for the "
               "other, in both directions; the budget, if that number does not cost less. Savings compare budgets with "
               "budgets and least costs with least costs. Cost of a good module: its share of station time and of "
               "modules that miss, without "
               "its own parts. Estimates with 95 % intervals; failed trials count as modules that miss.");
  for (const Group& group : page.groups) {
    if (std::none_of(group.rows.begin(), group.rows.end(), priced)) continue;
    const statistics::Prices& prices = group.prices;
    const std::string unit = prices.currency.empty() ? "" : ", " + prices.currency;
    const bool saves = std::any_of(group.rows.begin(), group.rows.end(),
                                   [](const Row& row) { return !row.costs.empty() && row.costs.front().saves.n > 0; });
    html.element("p", {{"class", "quiet"}}, prices_sentence(prices));
    html.open("div", {{"class", "scroll"}}).open("table", {{"class", "sortable"}});
    html.element("caption", group.label).open("thead").open("tr");
    for (const std::string& title :
         {std::string("method"), std::string("images, the one at the start included"), std::string("in spec"),
          std::string("station time, s"), std::string("good modules an hour"), std::string("scrapped per 1,000"),
          "cost of a good module" + unit})
      html.element("th", {{"scope", "col"}}, title);
    if (saves) html.element("th", {{"scope", "col"}}, "saves against " + prices.baseline + unit);
    html.close().close().open("tbody");
    for (const Row& row : group.rows)
      for (const CostStudy& cost : row.costs)
        if (is_shown(cost, row.costs.front())) cost_row(html, row, cost, &cost != &row.costs.front(), saves);
    html.close().close().close();
  }
  return html.take();
}

std::string costs_csv(const PageModel& page) {
  const auto band = [](const Band& of) {
    std::string csv;
    for (const double value : {of.estimate, of.interval.low, of.interval.high})
      csv += ',' + (std::isinf(value) ? std::string("inf") : sort_value(shown(value)));
    return csv;
  };
  std::string csv = "scene,noise_level,protocol,algorithm,images,images_other_half,chosen,n";
  for (const char* name : {"in_spec", "station_seconds", "good_per_hour", "scrapped", "cost_per_good", "saves"})
    csv += std::string(",") + name + ',' + name + "_lo95," + name + "_hi95";
  csv += ",currency\n";
  for (const Group& group : page.groups)
    for (const Row& row : group.rows)
      for (const CostStudy& cost : row.costs)
        csv += csv_field(group.scene) + ',' + csv_field(group.noise_level) + ',' + csv_field(group.protocol) + ',' +
               csv_field(row.method) + ',' + std::to_string(cost.steps[0] + 1) + ',' +
               std::to_string(cost.steps[1] + 1) + ',' + (&cost == &row.costs.front() ? "budget" : "least_cost") + ',' +
               std::to_string(cost.met.n) + band(cost.met) + band(cost.seconds) + band(cost.good_per_hour) +
               band(cost.scrapped) + band(cost.per_good_module) + band(cost.saves) + ',' +
               csv_field(group.prices.currency) + '\n';
  return csv;
}

}  // namespace relign::report
