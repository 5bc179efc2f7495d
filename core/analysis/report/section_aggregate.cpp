// Aggregate performance of each method over all scenes and noise levels.
#include <algorithm>
#include <cmath>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/aggregate_data.h"
#include "report/figure_html.h"
#include "report/page_groups.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxAggregateMethods = 12;  // in a figure or the table of pairs
constexpr std::size_t kFewTrainings = 5;
constexpr const char* kTo = "\u2013";

const Json& value_of(const Json& method, const std::string& name) { return member(method, name.c_str()); }

void interval_cell(HtmlWriter& html, const Json& method, const std::string& name) {
  const Json &value = value_of(method, name), &low = value_of(method, name + "_lo95"),
             &high = value_of(method, name + "_hi95");
  html.open("td", {{"class", "number"}, {"data-sort", sort_value(value)}});
  html.element("b", number_text(value, 3));
  if (low.is_number() && high.is_number())
    html.text(" ").element("span", {{"class", "quartiles"}},
                           "(" + number_text(low, 3) + kTo + number_text(high, 3) + ")");
  html.close();
}

// A dot at the estimate and a bar over the interval, on a scale from 0 to 1.
void range_cell(HtmlWriter& html, const Json& method) {
  const Json &value = value_of(method, "iqm"), &low = value_of(method, "iqm_lo95"),
             &high = value_of(method, "iqm_hi95");
  html.open("td", {{"class", "range"}, {"data-sort", sort_value(value)}});
  if (value.is_number()) {
    const auto x = [](const Json& place) { return significant(5 + 170 * place.get<double>(), 4); };
    html.open("svg", {{"viewBox", "0 0 180 14"}, {"width", "180"}, {"height", "14"}, {"aria-hidden", "true"}});
    html.empty("path", {{"d", "M5 7H175M5 3v8M90 4v6M175 3v8"}, {"class", "scale"}, {"fill", "none"}});
    if (low.is_number() && high.is_number())
      html.empty("line", {{"x1", x(low)}, {"x2", x(high)}, {"y1", "7"}, {"y2", "7"}, {"class", "bar"}});
    html.empty("circle", {{"cx", x(value)}, {"cy", "7"}, {"r", "3.5"}}).close();
  }
  html.close();
}

std::string percent(const Json& share) { return std::to_string(std::lround(100 * share.get<double>())); }

std::string improvement_text(const Json& pair) {
  const Json &share = member(pair, "improvement"), &low = member(pair, "lo95"), &high = member(pair, "hi95");
  if (!share.is_number()) return "-";
  return percent(share) + " %" +
         (low.is_number() && high.is_number() ? " (" + percent(low) + kTo + percent(high) + ")" : "");
}

const Json& pair_of(const Json& entry, const std::string& a, const std::string& b) {
  for (const Json& pair : entry["pairs"])
    if (text_of(pair, "a") == a && text_of(pair, "b") == b) return pair;
  return object_of(Json(), "");
}

void name_cell(HtmlWriter& html, const Json& method) {
  html.open("th", {{"scope", "row"}, {"class", "name"}, {"data-sort", text_of(method, "method")}});
  html.element("bdi", text_of(method, "method"));
  if (flag_of(method, "oracle")) html.text(" ").element("span", {{"class", "tag"}}, "oracle");
  if (const std::string tag = text_of(method, "training_tag"); !tag.empty())
    html.text(" ").element("span", {{"class", "tag"}}, tag);
  html.close();
}

void aggregate_row(HtmlWriter& html, const Json& entry, const Json& method, bool failures) {
  const std::string best = text_of(entry["methods"].front(), "method");
  const bool pairs = !entry["pairs"].empty();
  html.open("tr", {{"class", flag_of(method, "oracle") ? "oracle" : "plain"}});
  name_cell(html, method);
  if (count_of(method, "n") == 0) {
    html.element("td", {{"colspan", pairs ? "6" : "5"}, {"class", "quiet"}},
                 "results in " + std::to_string(count_of(method, "strata")) + " of " +
                     std::to_string(entry["strata"].size()) + " strata only: no aggregate");
  } else {
    interval_cell(html, method, "iqm");
    range_cell(html, method);
    for (const char* name : {"median", "gap", "area"}) interval_cell(html, method, name);
    if (pairs) {
      const Json& pair = pair_of(entry, best, text_of(method, "method"));
      html.element("td", {{"class", "number"}, {"data-sort", sort_value(member(pair, "improvement"))}},
                   improvement_text(pair));
    }
  }
  if (failures)
    html.element("td", {{"class", count_of(method, "failed") > 0 ? "number bad" : "number"}},
                 std::to_string(count_of(method, "failed")));
  html.close();
}

// A block per observation class, as in the ranking: methods with different observations are not comparable.
void table_blocks(HtmlWriter& html, const Json& entry, int columns, bool failures) {
  const std::vector<std::string> classes = classes_in(entry["methods"]);
  for (const std::string& name : classes) {
    html.open("tbody");
    if (classes.size() > 1) {
      html.open("tr", {{"class", "class"}});
      html.element("th", {{"colspan", std::to_string(columns)}, {"scope", "rowgroup"}}, class_title(name)).close();
    }
    for (const Json& method : entry["methods"])
      if (text_of(method, "class") == name) aggregate_row(html, entry, method, failures);
    html.close();
  }
}

void aggregate_table(HtmlWriter& html, const Json& entry) {
  const std::string best = text_of(entry["methods"].front(), "method");
  const bool failures = std::any_of(entry["methods"].begin(), entry["methods"].end(),
                                    [](const Json& method) { return count_of(method, "failed") > 0; });
  const bool pairs = !entry["pairs"].empty();
  html.open("div", {{"class", "scroll"}}).open("table", {{"class", "ranking sortable aggregate"}}).open("thead");
  html.open("tr");
  const auto head = [&html](const char* kind, const std::string& title, const char* unit, const char* hint) {
    html.open("th", {{"scope", "col"}, {"class", kind}, {"title", hint}}).element("span", {{"class", "title"}}, title);
    if (*unit) html.text(" ").element("span", {{"class", "unit"}}, unit);
    html.close();
  };
  head("name", "method", "", "The name given in the suite");
  head("number", "normalised error", "IQM (95 %)",
       "Interquartile mean: the mean of the middle half of all instances, with equal weights of the strata");
  head("range", "", "0 to 1", "Interquartile mean and its interval on a scale from 0 to 1");
  head("number", "median", "(95 %)", "Median over all instances, with equal weights of the strata");
  head("number", "optimality gap", "mean (95 %)", "Mean normalised error, which includes outliers");
  head("number", "error-curve area", "mean over images (95 %)",
       "Normalised error, averaged over the images of the budget and over the instances: low for methods that converge "
       "fast");
  if (pairs)
    head("number", "P(" + best + " better)", "of instances (95 %)",
         "Probability of improvement of the first method over this one: share of instances with a lower error; ties "
         "count half");
  if (failures) head("number", "failed", "trials", "Failed trials count as error 1");
  html.close().close();
  table_blocks(html, entry, 6 + (pairs ? 1 : 0) + (failures ? 1 : 0), failures);
  html.close().close();
}

// The variation between trainings, for each method with several.
void trainings(HtmlWriter& html, const Json& entry) {
  for (const Json& method : entry["methods"]) {
    const Json &list = list_of(method, "trainings"), &spread = object_of(method, "spread");
    if (spread.empty()) continue;
    html.open("details", {{"class", "trainings"}}).open("summary").element("bdi", text_of(method, "method"));
    html.text(": IQM of " + std::to_string(list.size()) + " trainings " + number_text(member(spread, "lowest"), 3) +
              " to " + number_text(member(spread, "highest"), 3) + ", standard deviation " +
              number_text(member(spread, "sd"), 2) +
              (list.size() < kFewTrainings ? "; with fewer than 5 trainings the interval is wide" : ""));
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
    for (const Json& training : list) {
      html.open("tr").open("th", {{"scope", "row"}, {"class", "name"}, {"data-sort", text_of(training, "training")}});
      html.element("bdi", text_of(training, "training")).close();
      interval_cell(html, training, "iqm");
      range_cell(html, training);
      interval_cell(html, training, "gap");
      interval_cell(html, training, "area");
      html.close();
    }
    html.close().close().close().close();
  }
}

// Probability of improvement of a row's method over a column's.
void matrix(HtmlWriter& html, const Json& entry) {
  std::vector<std::string> names;
  for (const Json& method : entry["methods"])
    if (count_of(method, "n") > 0) names.push_back(text_of(method, "method"));
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
      const Json& pair = pair_of(entry, names[row], names[column]);
      const bool decided = member(pair, "lo95").is_number() &&
                           (member(pair, "lo95").get<double>() > 0.5 || member(pair, "hi95").get<double>() < 0.5);
      html.open("td", {{"class", decided ? "number" : "number quiet"}});
      html.element(decided ? "b" : "span", column <= row ? "" : improvement_text(pair)).close();
    }
    html.close();
  }
  html.close().close().close().close();
}

}  // namespace

std::string aggregate_section(const Json& data) {
  const Json& all = list_of(data, "aggregate");
  if (all.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Aggregate over all scenes and noise levels");
  html.element(
      "p", {{"class", "quiet"}},
      "Normalised error: 0 is the instance's own optimum (within an RMSE of " +
          number_text(member(all.front(), "resolution"), 1) +
          "), 1 is no better than the start, and the scale between is logarithmic. Lower is better. Each stratum, a "
          "scene at a noise level, has the same weight; a failed trial counts as 1. Intervals are 95 % confidence "
          "intervals by a stratified bootstrap over instances, and over trainings for methods with several.");
  for (std::size_t index = 0; index < all.size(); ++index) {
    const Json& entry = all[index];
    std::uint64_t least = 0, most = 0;
    for (const Json& stratum : entry["strata"]) {
      const std::uint64_t count = count_of(stratum, "instances");
      least = least == 0 ? count : std::min(least, count);
      most = std::max(most, count);
    }
    const std::string label = text_of(entry, "label");
    html.open("h3").element("bdi", (label.empty() ? "" : label + ": ") + "protocol " + text_of(entry, "protocol"));
    html.element("span", {{"class", "quiet"}},
                 " \u00b7 " +
                     (entry["strata"].size() == 1 ? std::string("1 stratum")
                                                  : std::to_string(entry["strata"].size()) + " strata") +
                     " \u00b7 " +
                     (least == most ? counted(most, "instance")
                                    : std::to_string(least) + " to " + counted(most, "instance")) +
                     " each")
        .close();
    aggregate_table(html, entry);
    trainings(html, entry);
    matrix(html, entry);
    html.open("div", {{"class", "figures"}});
    for (const Figure& figure : aggregate_figures(data, index, kMaxAggregateMethods)) figure_html(html, figure, false);
    html.close();
    std::size_t with_numbers = 0;
    for (const Json& method : entry["methods"]) with_numbers += count_of(method, "n") > 0 ? 1 : 0;
    if (with_numbers > kMaxAggregateMethods)
      html.element("p", {{"class", "quiet"}},
                   "Figures show the first " + std::to_string(kMaxAggregateMethods) + " of " +
                       std::to_string(with_numbers) + " methods; the table lists all.");
  }
  return html.take();
}

}  // namespace relign::report
