// Pairwise comparisons of the methods of each group, folded at first.
#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/aggregate_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxPairs = 66;  // of a group (twelve methods); of more, only those of the best method

void pair_row(HtmlWriter& html, const Json& data, const Json& pair) {
  const auto number = [&](const std::string& text) { html.element("td", {{"class", "number"}}, text); };
  html.open("tr");
  for (const char* key : {"a", "b"}) {
    html.open("td").element("bdi", text_of(pair, key));
    if (const std::string tag = training_tag(data, text_of(pair, key)); !tag.empty())
      html.text(" ").element("span", {{"class", "tag"}}, tag);
    html.close();
  }
  html.open("td", {{"class", "words"}}).text(text_of(pair, "verdict"));
  if (const std::string reason = text_of(pair, "reason"); !reason.empty())
    html.text(" ").element("span", {{"class", "quiet"}}, "(" + reason + ")");
  html.close();
  const Json ratio = member(pair, "ratio"), low = member(pair, "lo95"), high = member(pair, "hi95");
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(ratio)}},
               number_text(ratio, 3) + (low.is_number() && high.is_number()
                                            ? " (" + number_text(low, 3) + "\u2013" + number_text(high, 3) + ")"
                                            : ""));
  const Json improvement = member(pair, "improvement");
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(improvement)}},
               improvement.is_number() ? significant(100 * improvement.get<double>(), 3) + " %" : std::string("-"));
  number(number_text(member(pair, "p"), 2));
  number(number_text(member(pair, "p_holm"), 2));
  number(number_text(member(pair, "n"), 6));
  html.close();
}

void pairs_head(HtmlWriter& html) {
  static constexpr const char* kColumns[][2] = {
      {"a", "First method"},
      {"b", "Second method, on the same instances"},
      {"verdict", "Of a compared with b"},
      {"error ratio a / b",
       "Interquartile mean of the paired ratios (of their logarithms) with its 95 % interval; below 1, a is better"},
      {"P(a better)", "Probability of improvement: share of instances on which a has the lower error; ties count half"},
      {"p", "p value of Wilcoxon's signed-rank test, two-sided"},
      {"p, Holm", "p value with Holm's correction for the number of comparisons"},
      {"instances", "With a result of both"}};
  html.open("thead").open("tr");
  for (const auto& [title, hint] : kColumns)
    html.open("th", {{"scope", "col"}, {"title", hint}}).element("span", {{"class", "title"}}, title).close();
  html.close().close();
}

}  // namespace

std::string pairs_section(const Json& data) {
  HtmlWriter html;
  bool any = false;
  std::size_t index = 0;
  for (const Json& group : data["groups"]) {
    const std::string best = text_of(data["verdict"][index++], "best");
    const Json& pairs = list_of(group, "pairs");
    if (pairs.empty()) continue;
    if (!any) {
      html.element("h2", "Pairwise comparisons");
      html.element("p", {{"class", "quiet"}},
                   "Paired by instance. 'Better' and 'worse' require the whole 95 % interval beyond the smallest "
                   "relevant ratio, "
                   "'practically equal' the whole interval within it.");
    }
    any = true;
    const bool all = pairs.size() <= kMaxPairs;
    html.open("details", {{"class", "pairs"}}).open("summary").element("bdi", text_of(group, "label"));
    html.text(" (" + counted(pairs.size(), "pair") + (all || best.empty() ? "" : "; shown: comparisons with " + best) +
              ")")
        .close();
    html.open("div", {{"class", "scroll"}}).open("table", {{"class", "sortable"}});
    pairs_head(html);
    html.open("tbody");
    std::size_t shown = 0;
    for (const Json& pair : pairs) {
      if (!all && text_of(pair, "a") != best && text_of(pair, "b") != best) continue;
      if (++shown > kMaxPairs) break;
      pair_row(html, data, pair);
    }
    html.close().close().close().close();
  }
  return any ? html.take() : "";
}

}  // namespace relign::report
