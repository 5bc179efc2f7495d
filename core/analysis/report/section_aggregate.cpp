// Aggregate performance of each method over all scenes and noise levels.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/figure_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxAggregateMethods = 12;  // in a figure or the table of pairs
constexpr std::size_t kFewTrainings = 5;
constexpr const char* kTo = "\u2013";

void band_cell(HtmlWriter& html, const statistics::Band& band) {
  interval_cell(html, "number", sort_value(band.estimate), number_text(band.estimate, 3),
                interval_text(band.interval, 3, kTo));
}

std::string improvement_text(const AggregatePair* pair) {
  if (!pair || !std::isfinite(pair->improvement.estimate)) return "-";
  const statistics::Interval& interval = pair->improvement.interval;
  return whole_percent(pair->improvement.estimate) + " %" +
         (interval.exists() ? " (" + whole_percent(interval.low) + kTo + whole_percent(interval.high) + ")" : "");
}

void aggregate_row(HtmlWriter& html, const Aggregate& entry, const AggregateMethod& method, bool failures) {
  const bool pairs = !entry.pairs.empty();
  html.open("tr", {{"class", method.oracle() ? "oracle" : "plain"}});
  method_cell(html, method.method, method.oracle(), method.training_tag);
  if (!method.has_numbers()) {
    html.element("td", {{"colspan", pairs ? "6" : "5"}, {"class", "quiet"}},
                 "results in " + std::to_string(method.strata) + " of " + std::to_string(entry.strata.size()) +
                     " strata only: no aggregate");
  } else {
    band_cell(html, method.bands.iqm);
    range_cell(html, method.bands.iqm);
    for (const statistics::Band* band : {&method.bands.median, &method.bands.gap, &method.bands.area})
      band_cell(html, *band);
    if (pairs) {
      const AggregatePair* pair = entry.pair_of(entry.methods.front().method, method.method);
      html.element("td", {{"class", "number"}, {"data-sort", pair ? sort_value(pair->improvement.estimate) : ""}},
                   improvement_text(pair));
    }
  }
  if (failures)
    html.element("td", {{"class", method.failed > 0 ? "number bad" : "number"}}, std::to_string(method.failed));
  html.close();
}

// A block per observation class, as in the ranking: methods with different observations are not comparable.
void table_blocks(HtmlWriter& html, const Aggregate& entry, int columns, bool failures) {
  const std::vector<ObservationClass> classes = classes_in(entry.methods);
  for (const ObservationClass of_class : classes) {
    html.open("tbody");
    if (classes.size() > 1) {
      html.open("tr", {{"class", "class"}});
      html.element("th", {{"colspan", std::to_string(columns)}, {"scope", "rowgroup"}}, class_title(of_class)).close();
    }
    for (const AggregateMethod& method : entry.methods)
      if (method.of_class == of_class) aggregate_row(html, entry, method, failures);
    html.close();
  }
}

void aggregate_table(HtmlWriter& html, const Aggregate& entry) {
  const std::string& best = entry.methods.front().method;
  const bool failures = std::any_of(entry.methods.begin(), entry.methods.end(),
                                    [](const AggregateMethod& method) { return method.failed > 0; });
  const bool pairs = !entry.pairs.empty();
  html.open("div", {{"class", "scroll"}}).open("table", {{"class", "ranking sortable aggregate"}}).open("thead");
  html.open("tr");
  column_head(html, "name", "method", "", "The name given in the suite");
  column_head(html, "number", "normalised error", "IQM (95 %)",
              "Interquartile mean: the mean of the middle half of all instances, with equal weights of the strata");
  column_head(html, "range", "", "0 to 1", "Interquartile mean and its interval on a scale from 0 to 1");
  column_head(html, "number", "median", "(95 %)", "Median over all instances, with equal weights of the strata");
  column_head(html, "number", "optimality gap", "mean (95 %)", "Mean normalised error, which includes outliers");
  column_head(
      html, "number", "error-curve area", "mean over images (95 %)",
      "Normalised error, averaged over the images of the budget and over the instances: low for methods that converge "
      "fast");
  if (pairs)
    column_head(
        html, "number", "P(" + best + " better)", "of instances (95 %)",
        "Probability of improvement of the first method over this one: share of instances with a lower error; ties "
        "count half");
  if (failures) column_head(html, "number", "failed", "trials", "Failed trials count as error 1");
  html.close().close();
  table_blocks(html, entry, 6 + (pairs ? 1 : 0) + (failures ? 1 : 0), failures);
  html.close().close();
}

// The variation between trainings, for each method with several.
void trainings(HtmlWriter& html, const Aggregate& entry) {
  for (const AggregateMethod& method : entry.methods) {
    if (!method.spread) continue;
    const std::size_t count = method.trainings.size();
    html.open("details", {{"class", "trainings"}}).open("summary").element("bdi", method.method);
    html.text(": IQM of " + std::to_string(count) + " trainings " + number_text(method.spread->lowest, 3) + " to " +
              number_text(method.spread->highest, 3) + ", standard deviation " + number_text(method.spread->sd, 2) +
              (count < kFewTrainings ? "; with fewer than 5 trainings the interval is wide" : ""));
    html.close()
        .open("div", {{"class", "scroll"}})
        .open("table", {{"class", "sortable ranking"}})
        .open("thead")
        .open("tr");
    for (const char* title : {"training", "IQM (95 % over instances)", "", "optimality gap", "error-curve area"})
      html.open("th", {{"scope", "col"}, {"class", *title == 't' ? "name" : "number"}})
          .element("span", {{"class", "title"}}, title)
          .close();
    html.close().close().open("tbody");
    for (const AggregateTraining& training : method.trainings) {
      html.open("tr");
      method_cell(html, training.name, false, "");
      band_cell(html, training.bands.iqm);
      range_cell(html, training.bands.iqm);
      band_cell(html, training.bands.gap);
      band_cell(html, training.bands.area);
      html.close();
    }
    html.close().close().close().close();
  }
}

// Probability of improvement of a row's method over a column's.
void matrix(HtmlWriter& html, const Aggregate& entry) {
  std::vector<std::string> names;
  for (const AggregateMethod& method : entry.methods)
    if (method.has_numbers()) names.push_back(method.method);
  if (names.size() < 3 || names.size() > kMaxAggregateMethods) return;
  html.open("details", {{"class", "pairs"}});
  html.element("summary", "Probability of improvement of every method over every other");
  html.open("div", {{"class", "scroll"}}).open("table").open("thead").open("tr");
  html.element("th", {{"scope", "col"}}, "improves on");
  for (std::size_t column = 1; column < names.size(); ++column)
    html.open("th", {{"scope", "col"}, {"class", "number"}}).element("bdi", names[column]).close();
  html.close().close().open("tbody");
  for (std::size_t row = 0; row + 1 < names.size(); ++row) {
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", names[row]).close();
    for (std::size_t column = 1; column < names.size(); ++column) {
      const AggregatePair* pair = entry.pair_of(names[row], names[column]);
      const bool decided = pair && (pair->improvement.interval.low > 0.5 || pair->improvement.interval.high < 0.5);
      html.open("td", {{"class", decided ? "number" : "number quiet"}});
      html.element(decided ? "b" : "span", column <= row ? "" : improvement_text(pair)).close();
    }
    html.close();
  }
  html.close().close().close().close();
}

}  // namespace

void range_cell(HtmlWriter& html, const statistics::Band& band) {
  html.open("td", {{"class", "range"}, {"data-sort", sort_value(band.estimate)}});
  if (std::isfinite(band.estimate)) {
    const auto x = [](double place) { return significant(5 + 170 * place, 4); };
    html.open("svg", {{"viewBox", "0 0 180 14"}, {"width", "180"}, {"height", "14"}, {"aria-hidden", "true"}});
    html.empty("path", {{"d", "M5 7H175M5 3v8M90 4v6M175 3v8"}, {"class", "scale"}, {"fill", "none"}});
    if (band.interval.exists())
      html.empty(
          "line",
          {{"x1", x(band.interval.low)}, {"x2", x(band.interval.high)}, {"y1", "7"}, {"y2", "7"}, {"class", "bar"}});
    html.empty("circle", {{"cx", x(band.estimate)}, {"cy", "7"}, {"r", "3.5"}}).close();
  }
  html.close();
}

std::string aggregate_section(const PageModel& page) {
  if (page.aggregates.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Aggregate over all scenes and noise levels");
  html.element(
      "p", {{"class", "quiet"}},
      "Normalised error: 0 is the instance's own optimum (within an RMSE of " +
          number_text(statistics::kResolution, 1) +
          "), 1 is no better than the start, and the scale between is logarithmic. Lower is better. Each stratum, a "
          "scene at a noise level, has the same weight; a failed trial counts as 1. Intervals are 95 % confidence "
          "intervals by a stratified bootstrap over instances, and over trainings for methods with several.");
  for (std::size_t index = 0; index < page.aggregates.size(); ++index) {
    const Aggregate& entry = page.aggregates[index];
    std::size_t least = 0, most = 0;
    for (const Stratum& stratum : entry.strata) {
      least = least == 0 ? stratum.instances : std::min(least, stratum.instances);
      most = std::max(most, stratum.instances);
    }
    html.open("h3").element("bdi", (entry.label.empty() ? "" : entry.label + ": ") + "protocol " + entry.protocol);
    html.element("span", {{"class", "quiet"}},
                 " \u00b7 " +
                     (entry.strata.size() == 1 ? std::string("1 stratum")
                                               : std::to_string(entry.strata.size()) + " strata") +
                     " \u00b7 " +
                     (least == most ? counted(most, "instance")
                                    : std::to_string(least) + " to " + counted(most, "instance")) +
                     " each")
        .close();
    aggregate_table(html, entry);
    trainings(html, entry);
    matrix(html, entry);
    html.open("div", {{"class", "figures"}});
    for (const Figure& figure : aggregate_figures(page, index, kMaxAggregateMethods)) figure_html(html, figure, false);
    html.close();
    std::size_t with_numbers = 0;
    for (const AggregateMethod& method : entry.methods) with_numbers += method.has_numbers() ? 1 : 0;
    if (with_numbers > kMaxAggregateMethods)
      html.element("p", {{"class", "quiet"}},
                   "Figures show the first " + std::to_string(kMaxAggregateMethods) + " of " +
                       std::to_string(with_numbers) + " methods; the table lists all.");
  }
  return html.take();
}

}  // namespace relign::report
