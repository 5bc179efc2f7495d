// The ranking as Markdown: a table per scene and protocol, a column per noise level.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/escape.h"
#include "report/aggregate_data.h"
#include "report/page_data.h"
#include "report/rules_data.h"
#include "report/text_tables.h"

namespace relign::report {
namespace {

struct Row {
  bool oracle = false;
  std::string training_tag;
  std::map<std::string, const Json*> by_level;
};

// A missing value becomes a dash.
std::string cell(const std::map<std::string, const Json*>& rows, const std::string& level) {
  const auto found = rows.find(level);
  if (found == rows.end()) return "";
  const Json& row = *found->second;
  const Json& error = score_of(row);
  if (error["n"] == 0) return "failed";
  std::string text = number_or_dash(error["median"], 3);
  if (error["n"] != 1) text += " (" + number_or_dash(error["q25"], 3) + " - " + number_or_dash(error["q75"], 3) + ")";
  if (const Json& share = object_of(row, "yield").value("share", Json()); share.is_number())
    text += ", " + std::to_string(std::lround(100 * share.get<double>())) + " % in spec";
  if (const std::uint64_t failed = count_of(row, "failed"); failed > 0)
    text += ", " + std::to_string(failed) + " failed";
  return text;
}

// Mean of the logarithms over the levels, so that levels with large errors do not dominate.
double rank_value(const Row& row) {
  double sum = 0;
  for (const auto& [level, values] : row.by_level) {
    const Json& error = score_of(*values);
    if (error["n"] == 0 || !error["median"].is_number()) return HUGE_VAL;
    sum += std::log(std::max(1e-12, error["median"].get<double>()));
  }
  return sum / static_cast<double>(row.by_level.size());
}

// The slowest over the levels, for a single column of times.
double slowest_ms(const Row& row) {
  double slowest = -1;
  for (const auto& [level, values] : row.by_level)
    if (const Json& ms = (*values)["algorithm_ms_per_step"]; ms.is_number())
      slowest = std::max(slowest, ms.get<double>());
  return slowest;
}

std::string markdown_table(const std::vector<const Json*>& groups, const std::string& rule) {
  std::vector<std::string> levels;
  std::map<std::string, Row> rows;
  std::string starts;
  std::set<std::uint64_t> instances;
  std::set<std::uint64_t> steps;
  bool measured_only = false;
  for (const Json* group : groups) {
    const std::string level = text_of(*group, "noise_level");
    levels.push_back(level);
    instances.insert(count_of(*group, "instances"));
    measured_only = measured_only || flag_of(*group, "measured_only");
    starts += (starts.empty() ? "" : ", ") + number_or_dash((*group)["start"], 3);
    for (const Json& values : (*group)["rows"]) {
      Row& row = rows[text_of(values, "method")];
      row.oracle = flag_of(values, "oracle");
      row.training_tag = text_of(values, "training_tag");
      row.by_level[level] = &values;
      if (score_of(values)["n"] != 0) steps.insert(count_of(values, "step"));
    }
  }
  std::vector<std::pair<std::string, const Row*>> order;
  for (const auto& [name, row] : rows) order.emplace_back(name, &row);
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    // Methods without results at some level come last.
    const std::size_t of_a = a.second->by_level.size(), of_b = b.second->by_level.size();
    return of_a != of_b ? of_a > of_b : rank_value(*a.second) < rank_value(*b.second);
  });

  const auto range = [](const std::set<std::uint64_t>& numbers) {
    return numbers.empty() ? "0"
                           : std::to_string(*numbers.begin()) +
                                 (numbers.size() > 1 ? " to " + std::to_string(*numbers.rbegin()) : "");
  };
  std::string out = "**" + markdown_text(text_of(*groups.front(), "scene")) + ", protocol " +
                    markdown_text(text_of(*groups.front(), "protocol")) + "**: ";
  out += measured_only ? "lowest measured RMSE"
         : rule.empty() || rule == "own"
             ? "noise-free RMSE at the recommended pose after the last step"
             : std::string("noise-free RMSE at ") + rule_text(rule) + " after the last step";
  out += ", median (quartiles) of " + range(instances) + " instances; steps: " + range(steps) +
         "; median error at the start: " + starts + ".\n\n| method |";
  for (const std::string& level : levels) out += " " + markdown_text(level) + " |";
  out += " ms/step |\n|---|";
  for (std::size_t i = 0; i < levels.size(); ++i) out += "---|";
  out += "---:|\n";
  for (const auto& [name, row] : order) {
    out += "| " + markdown_text(name) + (row->oracle ? " (oracle)" : "") +
           (row->training_tag.empty() ? "" : " (" + row->training_tag + ")") + " |";
    for (const std::string& level : levels) out += " " + cell(row->by_level, level) + " |";
    const double ms = slowest_ms(*row);
    out += " " + (ms < 0 ? std::string("-") : significant(ms, 2)) + " |\n";
  }
  return out;
}

}  // namespace

std::string markdown_tables(const Json& data) {
  std::vector<std::pair<std::string, std::string>> order;  // scene and protocol
  std::map<std::pair<std::string, std::string>, std::vector<const Json*>> tables;
  for (const Json& group : data["groups"]) {
    const std::pair<std::string, std::string> key(text_of(group, "scene"), text_of(group, "protocol"));
    if (tables[key].empty()) order.push_back(key);
    tables[key].push_back(&group);
  }
  if (order.empty()) return "No trial has finished, nothing to rank yet.\n";
  std::string out = aggregate_markdown(data);
  for (const auto& key : order)
    out += (key == order.front() ? "" : "\n") + markdown_table(tables[key], text_of(data, "rule"));
  if (const std::string note = text_of(data, "rules_note"); !note.empty()) out += "\n" + markdown_text(note) + "\n";
  return out;
}

}  // namespace relign::report
