// The ranking as Markdown: a table per scene and protocol, a column per noise level.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/text.h"
#include "markup/escape.h"
#include "report/aggregate_data.h"
#include "report/matrix_data.h"
#include "report/rules_data.h"
#include "report/text_tables.h"

namespace relign::report {
namespace {

// A method over the noise levels.
struct MarkdownRow {
  bool oracle = false;
  std::string training_tag;
  std::map<std::string, const Row*> by_level;
};

// A missing value becomes a dash.
std::string cell(const MarkdownRow& of, const std::string& level, const SceneScore& score) {
  const auto found = of.by_level.find(level);
  if (found == of.by_level.end()) return "";
  const Row& row = *found->second;
  const Score& error = row.score();
  if (error.n == 0) return "failed";
  std::string text = number_text(error.median, 3);
  if (error.n != 1) text += " (" + number_text(error.q25, 3) + " - " + number_text(error.q75, 3) + ")";
  for (std::size_t i = 0; i < row.further.size() && i < score.further.size(); ++i)
    if (row.further[i].n > 0)
      text += ", " + markdown_text(score.further[i].name) + " " + number_text(row.further[i].estimate, 3);
  if (row.yield) text += ", " + whole_percent(row.yield->share) + " % in spec";
  if (row.failed > 0) text += ", " + std::to_string(row.failed) + " failed";
  return text;
}

// Mean of the logarithms over the levels, so that levels with large errors do not dominate.
double rank_value(const MarkdownRow& of) {
  double sum = 0;
  for (const auto& [level, row] : of.by_level) {
    const double median = row->score().median;
    if (std::isnan(median)) return HUGE_VAL;
    sum += std::log(std::max(1e-12, median));
  }
  return sum / static_cast<double>(of.by_level.size());
}

// Mean over the levels.
double mean_yield(const MarkdownRow& of) {
  double sum = 0;
  for (const auto& [level, row] : of.by_level) sum += row->yield ? row->yield->share : 0;
  return sum / static_cast<double>(of.by_level.size());
}

// The slowest over the levels, for a single column of times; -1 if unknown.
double slowest_ms(const MarkdownRow& of) {
  double slowest = -1;
  for (const auto& [level, row] : of.by_level)
    if (row->algorithm_ms_per_step > slowest) slowest = row->algorithm_ms_per_step;
  return slowest;
}

// "; then the medians of FWHM in arcsec"
std::string further_note(const SceneScore& score) {
  std::vector<std::string> labels;
  for (const FurtherScore& further : score.further) labels.push_back(markdown_text(further.label()));
  return labels.empty() ? "" : "; then the medians of " + join(labels, ", ");
}

std::string markdown_table(const std::vector<const Group*>& groups, statistics::Rule rule, bool by_yield) {
  std::vector<std::string> levels;
  std::map<std::string, MarkdownRow> rows;
  std::string starts, optima;
  std::set<std::size_t> instances, steps;
  bool measured_only = false, any_optimum = false;
  for (const Group* group : groups) {
    levels.push_back(group->noise_level);
    instances.insert(group->instances);
    measured_only = measured_only || group->measured_only;
    starts += (starts.empty() ? "" : ", ") + number_text(group->start, 3);
    optima += (optima.empty() ? "" : ", ") + excess_text(group->own_optimum, group->scored_by);
    any_optimum = any_optimum || std::isfinite(group->own_optimum);
    for (const Row& of_level : group->rows) {
      MarkdownRow& row = rows[of_level.method];
      row.oracle = of_level.oracle();
      row.training_tag = of_level.training_tag;
      row.by_level[group->noise_level] = &of_level;
      if (of_level.has_score()) steps.insert(of_level.step);
    }
  }
  std::vector<std::pair<std::string, const MarkdownRow*>> order;
  for (const auto& [name, row] : rows) order.emplace_back(name, &row);
  std::stable_sort(order.begin(), order.end(), [by_yield](const auto& a, const auto& b) {
    // Methods without results at some level come last.
    const std::size_t of_a = a.second->by_level.size(), of_b = b.second->by_level.size();
    if (of_a != of_b) return of_a > of_b;
    const double yield_a = mean_yield(*a.second), yield_b = mean_yield(*b.second);
    return by_yield && yield_a != yield_b ? yield_a > yield_b : rank_value(*a.second) < rank_value(*b.second);
  });

  const auto range = [](const std::set<std::size_t>& numbers) {
    return numbers.empty() ? "0"
                           : std::to_string(*numbers.begin()) +
                                 (numbers.size() > 1 ? " to " + std::to_string(*numbers.rbegin()) : "");
  };
  std::string out =
      "**" + markdown_text(groups.front()->scene) + ", protocol " + markdown_text(groups.front()->protocol) + "**: ";
  const std::string score = groups.front()->scored_by.label();
  out += measured_only                   ? "lowest measured " + score
         : rule == statistics::Rule::own ? "noise-free " + score + " at the recommended pose after the last step"
                                         : "noise-free " + score + " at " + rule_text(rule) + " after the last step";
  out += ", median (quartiles) of " + range(instances) + " instances; steps: " + range(steps) +
         "; median error at the start: " + starts + (any_optimum ? "; best possible: " + optima : "") +
         further_note(groups.front()->scored_by) + (by_yield ? "; by yield" : "") + ".\n\n| method |";
  for (const std::string& level : levels) out += " " + markdown_text(level) + " |";
  out += " ms/step |\n|---|";
  for (std::size_t i = 0; i < levels.size(); ++i) out += "---|";
  out += "---:|\n";
  for (const auto& [name, row] : order) {
    out += "| " + markdown_text(name) + (row->oracle ? " (oracle)" : "") +
           (row->training_tag.empty() ? "" : " (" + row->training_tag + ")") + " |";
    for (const std::string& level : levels) out += " " + cell(*row, level, groups.front()->scored_by) + " |";
    const double ms = slowest_ms(*row);
    out += " " + (ms < 0 ? std::string("-") : significant(ms, 2)) + " |\n";
  }
  return out;
}

std::string failed_gates(const PageModel& page) {
  std::string list;
  for (const QualityGate& gate : page.gates)
    if (!gate.ok) list += "* **" + markdown_text(gate.name) + "**: " + markdown_text(gate.text) + "\n";
  return list.empty() ? "" : "**Failed checks; do not rely on these results:**\n\n" + list + "\n";
}

}  // namespace

std::string markdown_tables(const PageModel& page) {
  std::vector<std::pair<std::string, std::string>> order;  // scene and protocol
  std::map<std::pair<std::string, std::string>, std::vector<const Group*>> tables;
  for (const Group& group : page.groups) {
    const std::pair key(group.scene, group.protocol);
    if (tables[key].empty()) order.push_back(key);
    tables[key].push_back(&group);
  }
  std::string out = failed_gates(page);
  out += order.empty() ? "No trial has finished, nothing to rank yet.\n" : aggregate_markdown(page);
  for (const auto& key : order)
    out += (key == order.front() ? "" : "\n") + markdown_table(tables[key], page.rule, page.analysis.primary_is_yield);
  if (const std::string matrix = matrix_markdown(page); !matrix.empty()) out += "\n" + matrix;
  if (!page.rules_note.empty()) out += "\n" + markdown_text(page.rules_note) + "\n";
  if (!page.caveats.empty()) out += "\n";
  for (const std::string& caveat : page.caveats) out += "* " + markdown_text(caveat) + "\n";
  return out;
}

}  // namespace relign::report
