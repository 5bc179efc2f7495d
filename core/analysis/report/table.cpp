// The ranking for the terminal: plain text, at most 90 columns, a block per scene, noise level and protocol.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/text.h"
#include "markup/escape.h"
#include "report/matrix_data.h"
#include "report/rules_data.h"
#include "report/spec_words.h"
#include "report/text_tables.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxColumns = 90;
constexpr std::size_t kMinNameColumns = 10;

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::size_t used = columns(text);
  const std::string gap(used < width ? width - used : 0, ' ');
  return right ? gap + text : text + gap;
}

using Cells = std::vector<std::string>;

// Optional columns.
struct Extra {
  bool yield = false, instances = false, steps = false;
};

// Some trials have not been run yet; failures have a column of their own.
bool over_different_instances(const Group& group) {
  std::set<std::size_t> counts;
  for (const Row& row : group.rows) counts.insert(row.score().n + row.failed);
  return counts.size() > 1;
}

Cells row_cells(const Row& row, const Extra& extra) {
  const Score& error = row.score();
  Cells cells = {terminal_text(row.method), number_text(error.median, 3),
                 error.n > 1 ? "(" + number_text(error.q25, 3) + " - " + number_text(error.q75, 3) + ")" : "",
                 number_text(row.machine_seconds, 3), number_text(row.algorithm_ms_per_step, 2)};
  // There is room for one of these columns.
  if (!extra.yield && !extra.instances)
    cells.insert(cells.begin() + 3, row.has_score() ? number_text(row.commanded.median, 3) : "-");
  if (extra.yield) cells.push_back(row.yield ? whole_percent(row.yield->share) + " %" : "-");
  if (extra.instances) cells.push_back(std::to_string(error.n));
  if (extra.steps) cells.push_back(std::to_string(row.step));
  cells.push_back(std::to_string(row.failed));
  return cells;
}

bool one_training(const Row& row) { return row.training_tag == kOneTraining; }

std::string group_lines(const Group& group, bool show_steps) {
  Extra extra;
  extra.steps = show_steps;
  extra.instances = over_different_instances(group);
  for (const Row& row : group.rows) extra.yield = extra.yield || row.yield;
  Cells head = {"method", "error", "(quartiles)", "machine s", "ms/step"};
  if (!extra.yield && !extra.instances) head.insert(head.begin() + 3, "commanded");
  if (extra.yield) head.emplace_back("in spec");
  if (extra.instances) head.emplace_back("instances");
  if (extra.steps) head.emplace_back("steps");
  head.emplace_back("failed");
  std::vector<Cells> lines = {head};
  std::vector<std::string> marks = {""};  // after the name, never clipped
  for (const Row& row : group.rows) {
    lines.push_back(row_cells(row, extra));
    marks.push_back(std::string(row.oracle() ? " (oracle)" : "") + (one_training(row) ? " *" : ""));
  }

  std::vector<std::size_t> widths(head.size(), 0);
  for (std::size_t k = 0; k < lines.size(); ++k)
    for (std::size_t i = 0; i < head.size(); ++i)
      widths[i] = std::max(widths[i], columns(lines[k][i]) + (i == 0 ? columns(marks[k]) : 0));

  // Long names are clipped, numbers never.
  std::size_t others = 2;
  for (std::size_t i = 1; i < widths.size(); ++i) others += widths[i] + (i == 2 ? 1 : 2);
  const std::size_t name_room = std::max(kMinNameColumns, kMaxColumns - std::min(kMaxColumns, others));
  widths[0] = std::min(widths[0], name_room);

  std::string out = terminal_text(group.scene) + ", " + terminal_text(group.noise_level) + ", " +
                    terminal_text(group.protocol) + ", " + counted(group.instances, "instance");
  if (std::isfinite(group.start)) out += ", median error at the start " + number_text(group.start, 3);
  if (group.measured_only) out += ", measured only";
  out = clipped(out, kMaxColumns) + "\n";
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const Cells& line = lines[k];
    std::string text = "  " + padded(clipped(line[0], name_room - columns(marks[k])) + marks[k], widths[0], false);
    for (std::size_t i = 1; i < line.size(); ++i) text += (i == 2 ? " " : "  ") + padded(line[i], widths[i], i != 2);
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  }
  if (std::any_of(group.rows.begin(), group.rows.end(), one_training))
    out += "  * one training run: another run may give other results\n";
  if (extra.instances) out += "  medians are over different instances: not a ranking until all methods have the same\n";
  if (std::isfinite(group.own_optimum))
    out += "  best possible: " + excess_text(group.own_optimum, group.scored_by) +
           ", the median of the instances' optima\n";
  if (const std::string spec = spec_words(group.spec, group.scored_by); extra.yield && !spec.empty())
    out += clipped("  spec: " + terminal_text(spec), kMaxColumns) + "\n";
  return out;
}

}  // namespace

std::string ranking_table(const PageModel& page) {
  const RunState& ran = page.ran;
  std::string counts = std::to_string(ran.finished) + " of " + std::to_string(ran.planned) + " trials finished";
  if (ran.failed > 0) counts += ", " + std::to_string(ran.failed) + " failed";
  if (page.groups.empty()) return counts + ", nothing to rank yet.\n";

  const PageModel::StepRange steps = page.steps.value_or(PageModel::StepRange());
  std::string out;
  for (const QualityGate& gate : page.gates)
    if (!gate.ok && gate.name != "ran" && gate.name != "failures")
      out += "FAILED " + gate.name + ": " + terminal_text(gate.text) + "\n";
  const std::string score = common_score(page).label();
  if (!every_group(page, &Group::measured_only))
    out += (page.rule == statistics::Rule::own
                ? "Error: noise-free " + score + " at the recommended pose after the last step"
                : "Error: noise-free " + score + " at " + rule_text(page.rule)) +
           ", median over instances\n";
  if (any_group(page, &Group::measured_only))
    out += "Error, if measured only: lowest measured " + score + ", since a station has no ground truth\n";
  if (steps.least == steps.most) out += "steps: " + std::to_string(steps.most) + "   ";
  out += counts + "\n";
  for (const Group& group : page.groups) out += "\n" + group_lines(group, steps.least != steps.most);
  return out;
}

}  // namespace relign::report
