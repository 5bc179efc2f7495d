// Results by each recommendation rule, and the analysis plan with its outcome.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/rules_data.h"
#include "report/sections.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

constexpr double kAlpha = 0.05;

void rule_cells(HtmlWriter& html, const RuleScore& score, bool yields, bool steps) {
  if (score.median.n > 0) {
    interval_cell(html, "number", sort_value(score.median.estimate), number_text(score.median.estimate, 3),
                  interval_text(score.median.interval, 3, "\u2013"));
  } else {
    html.element("td", {{"class", "number"}, {"data-sort", ""}}, "not recorded");
  }
  if (yields)
    html.element("td", {{"class", "number"}, {"data-sort", score.yield ? sort_value(score.yield->share) : ""}},
                 score.yield ? whole_percent(score.yield->share) + " %" : "-");
  if (steps)
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(score.steps)}},
                 std::isinf(score.steps) ? "not reached" : number_text(score.steps, 3));
}

std::string error_words(const Pair& pair) {
  const std::string interval = interval_text(pair.interval, 3, " to ");
  return statistics::verdict_name(pair.verdict) + std::string(": error ratio first / second ") +
         number_text(pair.ratio, 3) + (interval.empty() ? "" : " (95 % CI " + interval + ")") +
         ", p (Holm, over the planned contrasts) " + number_text(pair.p_planned, 2) +
         (pair.reason.empty() ? "" : "; " + pair.reason);
}

std::string yield_words(const std::optional<PairYields>& yields) {
  if (!yields) return "undecided: the yields of both are unknown";
  const bool decided = yields->p_planned < kAlpha;
  return std::string(decided ? (yields->a_alone > yields->b_alone ? "better" : "worse") : "undecided") +
         ": in specification " + std::to_string(yields->a) + " and " + std::to_string(yields->b) + " of " +
         std::to_string(yields->n) + " instances, only with the first " + std::to_string(yields->a_alone) +
         ", only with the second " + std::to_string(yields->b_alone) + ", p (McNemar, Holm) " +
         number_text(yields->p_planned, 2) + (decided ? "" : "; p is not below 0.05");
}

// Methods whose yield is above, below and not distinguishable from the target yield.
std::string target_yield_text(const Group& group, double wanted) {
  std::string above, below, open;
  for (const Row& row : group.rows) {
    if (!row.yield || row.oracle()) continue;
    const statistics::Interval& interval = row.yield->interval;
    std::string& list = interval.low >= wanted ? above : interval.high < wanted ? below : open;
    list += (list.empty() ? "" : ", ") + row.method;
  }
  const std::string share = significant(100 * wanted, 3) + " %";
  std::string words;
  if (!above.empty()) words += "at least " + share + ": " + above + ". ";
  if (!below.empty()) words += "below " + share + ": " + below + ". ";
  if (!open.empty()) words += "undecided, since the 95 % interval contains " + share + ": " + open + ". ";
  return words;
}

}  // namespace

constexpr std::size_t kMaxRows = 2000;  // of the table, which keeps large pages under 10 MB

std::string rules_section(const PageModel& page) {
  if (!any_row(page, &Row::rules)) return "";
  bool yields = false, steps = false;
  std::size_t rows = 0;
  for (const Group& group : page.groups) {
    rows += group.rows.size();
    for (const Row& row : group.rows)
      for (const RuleScore& score : row.rules.value_or(statistics::ByRule<RuleScore>()).values) {
        yields = yields || score.yield;
        steps = steps || !std::isnan(score.steps);
      }
  }
  HtmlWriter html;
  html.element("h2", "Recommendation rules")
      .element("p", {{"class", "quiet"}},
               "The same trials scored at three poses after the last step. own: the pose recommended by the method. "
               "best: the pose with the lowest measured error. current: the current pose. This page uses the rule '" +
                   std::string(statistics::rule_name(page.rule)) + "'; choose another one with 'report --rule'.");
  if (rows > kMaxRows) {
    html.element("p", {{"class", "quiet"}},
                 "The table of " + std::to_string(rows) +
                     " rows is too large for this page; 'relign-bench report --format csv' writes it.");
    return html.take();
  }
  html.open("details", {{"class", "rules"}}).element("summary", "All methods by each rule");
  html.open("div", {{"class", "scroll"}}).open("table", {{"class", "sortable"}}).open("thead").open("tr");
  const auto head = [&html](const std::string& title, const char* unit) {
    html.open("th", {{"scope", "col"}}).element("span", {{"class", "title"}}, title);
    html.text(" ").element("span", {{"class", "unit"}}, unit).close();
  };
  head("method", "");
  for (const statistics::Rule rule : statistics::kRules) {
    head(statistics::rule_name(rule), "median (95 %)");
    if (yields) head("in spec", statistics::rule_name(rule));
    if (steps) head("moves to spec", statistics::rule_name(rule));
  }
  html.close().close();
  const std::size_t columns = 1 + statistics::kRules.size() * (1 + (yields ? 1 : 0) + (steps ? 1 : 0));
  for (const Group& group : page.groups) {
    if (!group.rules) continue;
    html.open("tbody").open("tr", {{"class", "group"}});
    html.open("th", {{"colspan", std::to_string(columns)}, {"scope", "rowgroup"}}).element("bdi", group.label);
    html.close().close();
    for (const Row& row : group.rows) {
      html.open("tr").open("th", {{"scope", "row"}}).element("bdi", row.method).close();
      for (const RuleScore& score : row.rules.value_or(statistics::ByRule<RuleScore>()).values)
        rule_cells(html, score, yields, steps);
      html.close();
    }
    html.close();
  }
  return html.take();
}

std::string analysis_section(const PageModel& page) {
  const Analysis& analysis = page.analysis;
  HtmlWriter html;
  for (const std::string& note : analysis.notes) html.element("p", {{"class", "broken"}}, note);
  if (analysis.plan.empty()) return html.take();
  html.element("p", {{"class", "facts"}}, analysis.summary);
  html.open("ul", {{"class", "verdict"}});
  const auto item = [&html](const Group& group, const std::string& text) {
    html.open("li").element("b", {{"class", "label"}}, group.label).text(": " + text).close();
  };
  for (const Group& group : page.groups) {
    for (const Pair& pair : group.pairs)
      if (pair.planned)
        item(group, pair.a + " against " + pair.b + ": " +
                        (analysis.primary_is_yield ? yield_words(pair.yields) : error_words(pair)) + ".");
    if (std::isnan(analysis.yield)) continue;
    if (const std::string words = target_yield_text(group, analysis.yield); !words.empty()) item(group, words);
  }
  return html.take();
}

}  // namespace relign::report
