// Aggregate performance of each method over all scenes and noise levels.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxAggregateMethods = 12;  // in a figure or the table of pairs
constexpr std::size_t kFewTrainings = 5;

Cell band_cell(const statistics::Band& band) {
  return estimate_cell(band.estimate, number_text(band.estimate, 3), interval_text(band.interval, 3, kDash));
}

Cell improvement_cell(const AggregatePair* pair) {
  if (!pair || !std::isfinite(pair->improvement.estimate)) return no_cell();
  Cell cell = share_cell(pair->improvement.estimate, pair->improvement.interval);
  for (Word& word : cell.words) word.look = "";
  return cell;
}

void add_method(Table& table, const Aggregate& entry, const AggregateMethod& method, bool failures) {
  std::vector<Cell> cells = {method_cell(method.method, method.oracle(), method.training_tag)};
  const bool pairs = !entry.pairs.empty();
  if (!method.has_numbers()) {
    Cell& cell = cells.emplace_back(Cell{"results in " + std::to_string(method.strata) + " of " +
                                         std::to_string(entry.strata.size()) + " strata only: no aggregate"});
    cell.kind = "quiet";
    cell.span = pairs ? 6 : 5;
  } else {
    for (const Cell& cell : {band_cell(method.bands.iqm), range_cell(method.bands.iqm), band_cell(method.bands.median),
                             band_cell(method.bands.gap), band_cell(method.bands.area)})
      cells.push_back(cell);
    if (pairs) cells.push_back(improvement_cell(entry.pair_of(entry.methods.front().method, method.method)));
  }
  if (failures)
    cells.push_back({std::to_string(method.failed), std::nullopt, method.failed > 0 ? "number bad" : "number"});
  table.add(std::move(cells), method.oracle() ? "oracle" : "");
}

Table aggregate_table(const Aggregate& entry, const SceneWords& words) {
  const std::string counts = words.counts();
  const bool failures = std::any_of(entry.methods.begin(), entry.methods.end(),
                                    [](const AggregateMethod& method) { return method.failed > 0; });
  Table table{
      "ranking aggregate",
      "",
      {{"method", "", "The name given in the suite", "name"},
       {"normalised error", "IQM (95 %)",
        "Interquartile mean: the mean of the middle half of all instances, with equal weights of the strata", "number"},
       {"", "0 to 1", "Interquartile mean and its interval on a scale from 0 to 1", "range"},
       {"median", "(95 %)", "Median over all instances, with equal weights of the strata", "number"},
       {"optimality gap", "mean (95 %)", "Mean normalised error, which includes outliers", "number"},
       {"error-curve area", "mean over " + counts + " (95 %)",
        "Normalised error, averaged over the " + counts +
            " of the budget and over the instances: low for methods that converge fast",
        "number"}}};
  if (!entry.pairs.empty())
    table.heads.push_back({"P(" + entry.methods.front().method + " better)", "of instances (95 %)",
                           "Probability of improvement of the first method over this one: share of instances with a "
                           "lower error; ties count half",
                           "number"});
  if (failures) table.heads.push_back({"failed", "trials", "Failed trials count as error 1", "number"});
  // A block per observation class, as in the ranking: methods with different observations are not comparable.
  const std::vector<ObservationClass> classes = classes_in(entry.methods);
  for (const ObservationClass of_class : classes) {
    if (classes.size() > 1) table.add_title(words.observed(class_title(of_class)), "class");
    for (const AggregateMethod& method : entry.methods)
      if (method.of_class == of_class) add_method(table, entry, method, failures);
  }
  return table;
}

// The variation between trainings, for each method with several.
void trainings(PageWriter& out, const Aggregate& entry) {
  for (const AggregateMethod& method : entry.methods) {
    if (!method.spread) continue;
    const std::size_t count = method.trainings.size();
    out.unfold(
        {{method.method, "name"},
         {": IQM of " + std::to_string(count) + " training runs " + number_text(method.spread->lowest, 3) + " to " +
          number_text(method.spread->highest, 3) + ", standard deviation " + number_text(method.spread->sd, 2) +
          (count < kFewTrainings ? "; with fewer than 5 runs the interval is wide" : "")}},
        "trainings");
    Table table{"ranking",
                "",
                {{"training run", "", "", "name"},
                 {"IQM (95 % over instances)", "", "", "number"},
                 {"", "", "", "number"},
                 {"optimality gap", "", "", "number"},
                 {"error-curve area", "", "", "number"}}};
    for (const AggregateTraining& training : method.trainings)
      table.add({method_cell(training.name, false, ""), band_cell(training.bands.iqm), range_cell(training.bands.iqm),
                 band_cell(training.bands.gap), band_cell(training.bands.area)});
    out.table(table).close();
  }
}

// Probability of improvement of a row's method over a column's.
void improvements(PageWriter& out, const Aggregate& entry) {
  std::vector<std::string> names;
  for (const AggregateMethod& method : entry.methods)
    if (method.has_numbers()) names.push_back(method.method);
  if (names.size() < 3 || names.size() > kMaxAggregateMethods) return;
  Table table{"", "", {{"improves on"}}};
  table.sortable = false;
  for (std::size_t column = 1; column < names.size(); ++column)
    table.heads.push_back({names[column], "", "", "number"});
  for (std::size_t row = 0; row + 1 < names.size(); ++row) {
    std::vector<Cell> cells = {method_cell(names[row], false, "")};
    for (std::size_t column = 1; column < names.size(); ++column) {
      const AggregatePair* pair = entry.pair_of(names[row], names[column]);
      const bool decided = pair && (pair->improvement.interval.low > 0.5 || pair->improvement.interval.high < 0.5);
      Cell cell = column <= row ? Cell{""} : improvement_cell(pair);
      cell.kind = decided ? "number" : "number quiet";
      if (decided)
        for (Word& word : cell.words) word.look = "strong";
      cells.push_back(std::move(cell));
    }
    table.add(std::move(cells));
  }
  out.unfold("Probability of improvement of every method over every other", "pairs").table(table).close();
}

std::string resolution_text(const PageModel& page) {
  if (std::isnan(page.aggregates.front().resolution)) return "the resolution of the scene's score";
  const SceneScore score = common_score(page);
  return (score.squared ? "an RMSE of " : "") + number_text(score.resolution, 1) + score.suffix();
}

}  // namespace

void aggregate_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  if (page.aggregates.empty()) return;
  out.heading(2, "Aggregate over all scenes and noise levels")
      .text("Normalised error: 0 is the instance's optimum (within " + resolution_text(page) +
                "), 1 is no better than the start, and the scale between is logarithmic. Lower is better. Each "
                "stratum, a scene at a noise level, has the same weight; a failed trial counts as 1. Intervals are "
                "95 % confidence intervals by a stratified bootstrap over instances, and over training runs for "
                "methods with several.",
            "quiet");
  for (std::size_t index = 0; index < page.aggregates.size(); ++index) {
    const Aggregate& entry = page.aggregates[index];
    std::size_t least = entry.strata.empty() ? 0 : entry.strata.front().instances, most = 0;
    for (const Stratum& stratum : entry.strata) {
      least = std::min(least, stratum.instances);
      most = std::max(most, stratum.instances);
    }
    const std::size_t strata = entry.strata.size();
    out.heading(
        3,
        {{(entry.label.empty() ? "" : entry.label + ": ") + "protocol " + entry.protocol, "name"},
         {" \u00b7 " + (strata == 1 ? std::string("1 stratum") : std::to_string(strata) + " strata") + " \u00b7 " +
              (least == most ? counted(most, "instance") : std::to_string(least) + " to " + counted(most, "instance")) +
              " each",
          "quiet"}});
    out.table(aggregate_table(entry, common_words(page)));
    trainings(out, entry);
    improvements(out, entry);
    out.open("figures");
    for (const Figure& figure : aggregate_figures(page, index, kMaxAggregateMethods)) out.chart(figure);
    out.close();
    const auto with_numbers = std::count_if(entry.methods.begin(), entry.methods.end(),
                                            [](const AggregateMethod& method) { return method.has_numbers(); });
    if (with_numbers > static_cast<std::ptrdiff_t>(kMaxAggregateMethods))
      out.text("Figures show the first " + std::to_string(kMaxAggregateMethods) + " of " +
                   std::to_string(with_numbers) + " methods; the table lists all.",
               "quiet");
  }
}

}  // namespace relign::report
