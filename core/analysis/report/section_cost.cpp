// What a good module costs with each method, by the prices of the suite.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"
#include "markup/escape.h"
#include "report/cost_text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

using statistics::Band;
using statistics::CostStudy;

Cell band_cell(const Band& band, int digits, double scale = 1, const std::string& unit = "") {
  if (band.n == 0) return no_cell("number quiet");
  if (!std::isfinite(band.estimate)) return {"no good module", "", "number quiet"};
  return estimate_cell(scale * band.estimate, number_text(scale * band.estimate, digits) + unit,
                       open_interval({scale * band.interval.low, scale * band.interval.high}, digits));
}

// What the row of the budget does not show already.
bool is_shown(const CostStudy& cost, const CostStudy& budget) {
  return &cost == &budget || cost.steps != budget.steps ||
         (cost.saves.n > 0 && cost.saves.estimate != budget.saves.estimate);
}

}  // namespace

std::string images_of(const CostStudy& cost) {
  const std::string first = std::to_string(cost.steps[0] + 1);
  return cost.steps[0] == cost.steps[1] ? first : first + " / " + std::to_string(cost.steps[1] + 1);
}

std::string prices_sentence(const Prices& prices) {
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

void cost_section(PageWriter& out, const PageParts& parts) {
  const auto priced = [](const Row& row) { return !row.costs.empty(); };
  if (!any_row(parts.page, priced)) return;
  const std::string captures = common_words(parts.page).captures();
  out.heading(3, "Cost").text(
      "A line that takes the same number of " + captures +
          " of every module, the one at the start included, and then "
          "glues it where the method recommends. Station time is the whole cycle, mean. 'chosen for least cost': the "
          "number of " +
          captures +
          " with which a good module costs least, chosen on one half of the instances for the other, in both "
          "directions; the budget, if that number does not cost less. Savings compare budgets with budgets and least "
          "costs "
          "with least costs. Cost of a good module: its share of station time and of modules that miss, without its "
          "own "
          "parts. Estimates with 95 % intervals; failed trials count as modules that miss.",
      "facts");
  for (const Group& group : parts.page.groups) {
    if (std::none_of(group.rows.begin(), group.rows.end(), priced)) continue;
    const Prices& prices = group.prices;
    const std::string unit = prices.currency.empty() ? "" : ", " + prices.currency;
    const bool saves = std::any_of(group.rows.begin(), group.rows.end(),
                                   [](const Row& row) { return !row.costs.empty() && row.costs.front().saves.n > 0; });
    Table table{"",
                group.label,
                {{"method"},
                 {captures + ", the one at the start included"},
                 {"in spec"},
                 {"station time, s"},
                 {"good modules an hour"},
                 {"scrapped per 1,000"},
                 {"cost of a good module" + unit}}};
    if (saves) table.heads.push_back({"saves against " + prices.baseline + unit});
    for (const Row& row : group.rows)
      for (const CostStudy& cost : row.costs) {
        if (!is_shown(cost, row.costs.front())) continue;
        Cell images = {images_of(cost), std::to_string(cost.steps[0]), "number"};
        if (&cost != &row.costs.front()) images.words.add(" ").add("chosen for least cost", "tag");
        std::vector<Cell> cells = {method_cell(row.method, row.oracle(), row.training_tag),
                                   std::move(images),
                                   band_cell(cost.met, 3, 100, " %"),
                                   band_cell(cost.seconds, 3),
                                   band_cell(cost.good_per_hour, 4),
                                   band_cell(cost.scrapped, 3, 1000),
                                   band_cell(cost.per_good_module, 3)};
        if (saves) cells.push_back(band_cell(cost.saves, 2));
        table.add(std::move(cells));
      }
    out.text(prices_sentence(prices), "quiet").table(table);
  }
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
