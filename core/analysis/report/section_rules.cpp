// Results by each recommendation rule, and the analysis plan with its outcome.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/rules_data.h"
#include "report/sections.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

constexpr double kAlpha = 0.05;

const Json& rule_entry(const Json& object, statistics::Rule rule) {
  return object_of(object_of(object, "rules"), statistics::rule_name(rule));
}

std::string percent(const Json& share) {
  return share.is_number() ? std::to_string(std::lround(100 * share.get<double>())) : "-";
}

void rule_cells(HtmlWriter& html, const Json& score, bool yields, bool steps) {
  const Json &median = member(score, "median"), &low = member(score, "lo95"), &high = member(score, "hi95");
  html.open("td", {{"class", "number"}, {"data-sort", sort_value(median)}});
  if (median.is_number()) {
    html.element("b", number_text(median, 3));
    if (low.is_number() && high.is_number())
      html.text(" ").element("span", {{"class", "quartiles"}},
                             "(" + number_text(low, 3) + "\u2013" + number_text(high, 3) + ")");
  } else {
    html.text("not recorded");
  }
  html.close();
  const Json& yield = object_of(score, "yield");
  if (yields)
    html.element("td", {{"class", "number"}, {"data-sort", sort_value(member(yield, "share"))}},
                 yield.empty() ? "-" : percent(yield["share"]) + " %");
  if (!steps) return;
  const Json& arrival = member(score, "steps");
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(arrival)}},
               arrival.is_string() ? "not reached" : number_text(arrival, 3));
}

std::string pair_words(const Json& pair, const std::string& primary) {
  if (primary != "yield") {
    std::string words =
        text_of(pair, "verdict") + ": error ratio first / second " + number_text(member(pair, "ratio"), 3);
    if (pair["lo95"].is_number() && pair["hi95"].is_number())
      words += " (95 % CI " + number_text(pair["lo95"], 3) + " to " + number_text(pair["hi95"], 3) + ")";
    words += ", p (Holm, over the planned contrasts) " + number_text(member(pair, "p_planned"), 2);
    const std::string reason = text_of(pair, "reason");
    return words + (reason.empty() ? "" : "; " + reason);
  }
  const Json& yields = object_of(pair, "yields");
  if (yields.empty()) return "undecided: the yields of both are unknown";
  const Json& p = member(yields, "p_planned");
  const std::uint64_t a = count_of(yields, "a_alone"), b = count_of(yields, "b_alone");
  const bool decided = p.is_number() && p.get<double>() < kAlpha;
  return std::string(decided ? (a > b ? "better" : "worse") : "undecided") + ": in specification " +
         std::to_string(count_of(yields, "a")) + " and " + std::to_string(count_of(yields, "b")) + " of " +
         std::to_string(count_of(yields, "n")) + " instances, only with the first " + std::to_string(a) +
         ", only with the second " + std::to_string(b) + ", p (McNemar, Holm) " + number_text(p, 2) +
         (decided ? "" : "; p is not below 0.05");
}

// Methods whose yield is above, below and not distinguishable from the target yield.
std::string target_yield_text(const Json& group, double wanted) {
  std::string above, below, open;
  for (const Json& row : group["rows"]) {
    const Json& yield = object_of(row, "yield");
    if (yield.empty() || !yield["lo95"].is_number() || flag_of(row, "oracle")) continue;
    std::string& list = yield["lo95"].get<double>() >= wanted  ? above
                        : yield["hi95"].get<double>() < wanted ? below
                                                               : open;
    list += (list.empty() ? "" : ", ") + text_of(row, "method");
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

std::string rules_section(const Json& data) {
  if (!any_row(data, "rules")) return "";
  bool yields = false, steps = false;
  std::size_t rows = 0;
  for (const Json& group : data["groups"]) {
    rows += group["rows"].size();
    for (const Json& row : group["rows"])
      for (const statistics::Rule rule : statistics::kRules) {
        yields = yields || !object_of(rule_entry(row, rule), "yield").empty();
        steps = steps || !member(rule_entry(row, rule), "steps").is_null();
      }
  }
  HtmlWriter html;
  html.element("h2", "Recommendation rules")
      .element("p", {{"class", "quiet"}},
               "The same trials scored at three poses after the last step. own: the pose recommended by the method. "
               "best: the pose with the lowest measured error. current: the current pose. This page uses the rule '" +
                   text_of(data, "rule") + "'; choose another one with 'report --rule'.");
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
    if (steps) head("images to spec", statistics::rule_name(rule));
  }
  html.close().close();
  const std::size_t columns = 1 + statistics::kRules.size() * (1 + (yields ? 1 : 0) + (steps ? 1 : 0));
  for (const Json& group : data["groups"]) {
    if (object_of(group, "rules").empty()) continue;
    html.open("tbody").open("tr", {{"class", "group"}});
    html.open("th", {{"colspan", std::to_string(columns)}, {"scope", "rowgroup"}})
        .element("bdi", text_of(group, "label"));
    html.close().close();
    for (const Json& row : group["rows"]) {
      html.open("tr").open("th", {{"scope", "row"}}).element("bdi", text_of(row, "method")).close();
      for (const statistics::Rule rule : statistics::kRules) rule_cells(html, rule_entry(row, rule), yields, steps);
      html.close();
    }
    html.close();
  }
  return html.take();
}

std::string analysis_section(const Json& data) {
  const Json &plan = object_of(data, "analysis"), &notes = list_of(data, "analysis_notes");
  HtmlWriter html;
  for (const Json& note : notes) html.element("p", {{"class", "broken"}}, note.get<std::string>());
  if (plan.empty()) return notes.empty() ? "" : html.take();
  const std::string primary = text_of(plan, "primary");
  std::string words = "Analysis plan (" + text_of(plan, "hash").substr(0, 16) + "): primary measure " + primary +
                      ", rule " + text_of(plan, "rule") + ", smallest relevant ratio " +
                      number_text(member(plan, "smallest_relevant_ratio"), 3);
  if (member(plan, "yield").is_number()) words += ", target yield " + number_text(plan["yield"], 3);
  html.element("p", {{"class", "facts"}}, words + ".");
  html.open("ul", {{"class", "verdict"}});
  for (const Json& group : data["groups"]) {
    for (const Json& pair : list_of(group, "pairs"))
      if (flag_of(pair, "planned"))
        html.open("li")
            .element("b", {{"class", "label"}}, text_of(group, "label"))
            .text(": " + text_of(pair, "a") + " against " + text_of(pair, "b") + ": " + pair_words(pair, primary) + ".")
            .close();
    if (const Json& wanted = member(plan, "yield"); wanted.is_number())
      if (const std::string of_yield = target_yield_text(group, wanted.get<double>()); !of_yield.empty())
        html.open("li").element("b", {{"class", "label"}}, text_of(group, "label")).text(": " + of_yield).close();
  }
  return html.take();
}

}  // namespace relign::report
