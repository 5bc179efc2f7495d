// Pairwise comparisons of the methods of each group, folded at first.
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxPairs = 66;  // of a group (twelve methods); of more, only those of the best method

void pair_row(HtmlWriter& html, const PageModel& page, const Pair& pair) {
  const auto number = [&](const std::string& text) { html.element("td", {{"class", "number"}}, text); };
  html.open("tr");
  for (const std::string* name : {&pair.a, &pair.b}) {
    html.open("td").element("bdi", *name);
    tag(html, training_tag(page.methods, *name));
    html.close();
  }
  html.open("td", {{"class", "words"}}).text(statistics::verdict_name(pair.verdict));
  if (!pair.reason.empty()) html.text(" ").element("span", {{"class", "quiet"}}, "(" + pair.reason + ")");
  html.close();
  const std::string interval = interval_text(pair.interval, 3, "\u2013");
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(pair.ratio)}},
               number_text(pair.ratio, 3) + (interval.empty() ? "" : " (" + interval + ")"));
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(pair.improvement)}},
               std::isfinite(pair.improvement) ? significant(100 * pair.improvement, 3) + " %" : std::string("-"));
  number(number_text(pair.p, 2));
  number(number_text(pair.p_holm, 2));
  number(std::to_string(pair.n));
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

std::string pairs_section(const PageModel& page) {
  HtmlWriter html;
  bool any = false;
  std::size_t index = 0;
  for (const Group& group : page.groups) {
    const std::string& best = page.verdict[index++].best;
    const std::vector<Pair>& pairs = group.pairs;
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
    html.open("details", {{"class", "pairs"}}).open("summary").element("bdi", group.label);
    html.text(" (" + counted(pairs.size(), "pair") + (all || best.empty() ? "" : "; shown: comparisons with " + best) +
              ")")
        .close();
    html.open("div", {{"class", "scroll"}}).open("table", {{"class", "sortable"}});
    pairs_head(html);
    html.open("tbody");
    std::size_t shown = 0;
    for (const Pair& pair : pairs) {
      if (!all && pair.a != best && pair.b != best) continue;
      if (++shown > kMaxPairs) break;
      pair_row(html, page, pair);
    }
    html.close().close().close().close();
  }
  return any ? html.take() : "";
}

}  // namespace relign::report
