// Pairwise comparisons of the methods of each group, folded at first.
#include <cmath>

#include "base/text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxPairs = 66;  // of a group (twelve methods); of more, only those of the best method

void add_pair(Table& table, const PageModel& page, const Pair& pair) {
  const auto method = [&](const std::string& name) {
    Cell cell = method_cell(name, false, training_tag(page.methods, name));
    cell.kind = "";
    return cell;
  };
  const std::string interval = interval_text(pair.interval, 3, kDash);
  Cell verdict = {statistics::verdict_name(pair.verdict), std::nullopt, "words"};
  if (!pair.reason.empty()) verdict.words.add(" ").add("(" + pair.reason + ")", "quiet");
  table.add(
      {method(pair.a),
       method(pair.b),
       verdict,
       {number_text(pair.ratio, 3) + (interval.empty() ? "" : " (" + interval + ")"), sort_value(pair.ratio), "number"},
       {std::isfinite(pair.improvement) ? significant(100 * pair.improvement, 3) + " %" : std::string("-"),
        sort_value(pair.improvement), "number"},
       number_cell(pair.p, 2),
       number_cell(pair.p_holm, 2),
       number_cell(std::to_string(pair.n))});
}

const std::vector<Head> kPairHeads = {
    {"a", "", "First method"},
    {"b", "", "Second method, on the same instances"},
    {"verdict", "", "Of a compared with b"},
    {"error ratio a / b", "",
     "Interquartile mean of the paired ratios (of their logarithms) with its 95 % interval; below 1, a is better"},
    {"P(a better)", "",
     "Probability of improvement: share of instances on which a has the lower error; ties count half"},
    {"p", "", "p value of Wilcoxon's signed-rank test, two-sided"},
    {"p, Holm", "", "p value with Holm's correction for the number of comparisons"},
    {"instances", "", "With a result of both"}};

}  // namespace

void pairs_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  if (!any_group(page, [](const Group& group) { return !group.pairs.empty(); })) return;
  out.heading(2, "Pairwise comparisons")
      .text(
          "Paired by instance. 'Better' and 'worse' require the whole 95 % interval beyond the smallest relevant "
          "ratio, "
          "'practically equal' the whole interval within it.",
          "quiet");
  std::size_t index = 0;
  for (const Group& group : page.groups) {
    const std::string& best = page.verdict[index++].best;
    if (group.pairs.empty()) continue;
    const bool all = group.pairs.size() <= kMaxPairs;
    Table table{"", "", kPairHeads};
    for (const Pair& pair : group.pairs)
      if ((all || pair.a == best || pair.b == best) && table.bodies[0].size() < kMaxPairs) add_pair(table, page, pair);
    out.unfold({{group.label, "name"},
                {" (" + counted(group.pairs.size(), "pair") +
                 (all || best.empty() ? "" : "; shown: comparisons with " + best) + ")"}},
               "pairs");
    out.table(table).close();
  }
}

}  // namespace relign::report
