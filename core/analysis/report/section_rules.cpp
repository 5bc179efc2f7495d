// Results by each recommendation rule, and the analysis plan with its outcome.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"
#include "report/rules_data.h"
#include "report/sections.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

constexpr double kAlpha = 0.05;

void add_rule_cells(std::vector<Cell>& cells, const RuleScore& score, bool yields, bool steps) {
  cells.push_back(score.median.n > 0 ? estimate_cell(score.median.estimate, number_text(score.median.estimate, 3),
                                                     interval_text(score.median.interval, 3, kDash))
                                     : Cell{"not recorded", "", "number"});
  if (yields)
    cells.push_back(score.yield
                        ? Cell{whole_percent(score.yield->share) + " %", sort_value(score.yield->share), "number"}
                        : no_cell());
  if (steps) cells.push_back(std::isinf(score.steps) ? Cell{"not reached", "", "number"} : number_cell(score.steps));
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

void rules_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  if (!any_row(page, &Row::rules)) return;
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
  out.heading(2, "Recommendation rules")
      .text(
          "The same trials scored at three poses after the last step. own: the pose recommended by the method. best: "
          "the pose with the lowest measured error. current: the current pose. This page uses the rule '" +
              std::string(statistics::rule_name(page.rule)) + "'; choose another one with 'report --rule'.",
          "quiet");
  if (rows > kMaxRows) {
    out.text("The table of " + std::to_string(rows) +
                 " rows is too large for this page; 'relign-bench report --format csv' writes it.",
             "quiet");
    return;
  }
  Table table{"", "", {{"method"}}};
  for (const statistics::Rule rule : statistics::kRules) {
    table.heads.push_back({statistics::rule_name(rule), "median (95 %)"});
    if (yields) table.heads.push_back({"in spec", statistics::rule_name(rule)});
    if (steps) table.heads.push_back({"moves to spec", statistics::rule_name(rule)});
  }
  for (const Group& group : page.groups) {
    if (!group.rules) continue;
    table.add_title(Words{{group.label, "name"}}, "group");
    for (const Row& row : group.rows) {
      std::vector<Cell> cells = {method_cell(row.method, false, "")};
      for (const RuleScore& score : row.rules.value_or(statistics::ByRule<RuleScore>()).values)
        add_rule_cells(cells, score, yields, steps);
      table.add(std::move(cells));
    }
  }
  out.unfold("All methods by each rule", "rules").table(table).close();
}

void analysis_section(PageWriter& out, const PageParts& parts) {
  const Analysis& analysis = parts.page.analysis;
  for (const std::string& note : analysis.notes) out.text(note, "broken");
  if (analysis.plan.empty()) return;
  std::vector<Words> items;
  const auto item = [&items](const Group& group, const std::string& text) {
    items.push_back({{group.label, "label"}, {": " + text}});
  };
  for (const Group& group : parts.page.groups) {
    for (const Pair& pair : group.pairs)
      if (pair.planned)
        item(group, pair.a + " against " + pair.b + ": " +
                        (analysis.primary_is_yield ? yield_words(pair.yields) : error_words(pair)) + ".");
    if (std::isnan(analysis.yield)) continue;
    if (const std::string words = target_yield_text(group, analysis.yield); !words.empty()) item(group, words);
  }
  out.text(analysis.summary, "facts").list(items, "verdict");
}

}  // namespace relign::report
