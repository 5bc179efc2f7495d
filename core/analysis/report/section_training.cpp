// Training cost and its break-even point.
#include <cmath>

#include "base/text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

std::string duration(double hours) {
  if (!std::isfinite(hours)) return "-";
  return hours < 1 ? significant(60 * hours, 2) + " min" : significant(hours, 3) + " h";
}

std::string devices_text(double count, const SceneWords& words) {
  return significant(rounded(count, 3), 3) + " " + (count == 1 ? words.device : words.devices);
}

void add_break_even(Words& words, const BreakEven& even, const Group& group) {
  const bool pays = std::isfinite(even.lenses), never = std::isinf(even.lenses);
  words.add(pays ? devices_text(even.lenses, group.words) : never ? "never" : "unknown", "strong");
  if (pays)
    words.add(": saves " + number_text(even.saves, 2) + " s per " + group.words.device + " over ")
        .add(even.against, "name");
  else if (never && even.against.empty())
    words.add(": fewer than half of the instances reach the specification");
  else if (never)
    words.add(": no faster than ").add(even.against, "name");
  else if (even.against.empty())
    words.add(": no method without training reaches the specification on half of the instances");
  if (std::isnan(even.modules)) return;
  words.add("; by cost, ")
      .add(std::isinf(even.modules) ? "never" : shortest(rounded(even.modules, 3)) + " good modules", "strong");
  words.add(" against ").add(group.prices.baseline, "name");
}

}  // namespace

void training_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  if (page.training.empty()) return;
  const SceneWords words = common_words(page);
  Table table{"training",
              "",
              {{"method"}, {"training time"}, {"training " + words.captures()}, {"machine"}, {"break-even after"}}};
  for (const TrainingCost& cost : page.training) {
    Words even;
    for (const BreakEven& one : cost.pays_after) {  // one line per group with a specification
      if (!even.empty()) even.add("\n");
      if (page.groups.size() > 1) even.add(one.label, "name").add(": ");
      add_break_even(even, one, page.groups[one.group]);
    }
    table.add({method_cell(cost.method, false, training_tag(page.methods, cost.method)),
               {duration(cost.hours), sort_value(cost.hours), "number"},
               {cost.stated ? number_text(cost.steps, 6) : std::to_string(std::llround(cost.steps)),
                sort_value(cost.steps), "number"},
               {cost.machine.empty() ? "-" : cost.machine, cost.machine},
               {even.empty() ? Words("-") : even,
                cost.pays_after.empty() ? "" : sort_value(cost.pays_after.front().lenses), "words lines"}});
  }
  out.heading(2, "Training cost").table(table);
  out.text(
      "Break-even: training time divided by the time that each " + words.device +
          " saves until it is in specification (machine and "
          "compute time, medians), compared with the fastest method without training. The effort of developing the "
          "recipe is not included.",
      "quiet");
}

}  // namespace relign::report
