// The ranking for the terminal: plain text, at most 90 columns, a block per scene, noise level and protocol.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/escape.h"
#include "report/aggregate_data.h"
#include "report/page_data.h"
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

std::string yield_cell_text(const Json& row) {
  const Json& share = object_of(row, "yield").value("share", Json());
  return share.is_number() ? std::to_string(std::lround(100 * share.get<double>())) + " %" : "-";
}

// Some trials have not been run yet; failures have a column of their own.
bool over_different_instances(const Json& group) {
  std::set<std::uint64_t> counts;
  for (const Json& row : group["rows"]) counts.insert(count_of(score_of(row), "n") + count_of(row, "failed"));
  return counts.size() > 1;
}

Cells row_cells(const Json& row, const Extra& extra) {
  const Json& error = score_of(row);
  const bool finished = error["n"] != 0;
  Cells cells = {terminal_text(text_of(row, "method"))};
  cells.insert(cells.end(),
               {finished ? number_or_dash(error["median"], 3) : "-",
                finished && error["n"] != 1
                    ? "(" + number_or_dash(error["q25"], 3) + " - " + number_or_dash(error["q75"], 3) + ")"
                    : "",
                number_or_dash(row["machine_seconds"], 3), number_or_dash(row["algorithm_ms_per_step"], 2)});
  // There is room for one of these columns.
  if (!extra.yield && !extra.instances)
    cells.insert(cells.begin() + 3, finished ? number_or_dash(row["commanded"].value("median", Json()), 3) : "-");
  if (extra.yield) cells.push_back(yield_cell_text(row));
  if (extra.instances) cells.push_back(std::to_string(count_of(error, "n")));
  if (extra.steps) cells.push_back(std::to_string(count_of(row, "step")));
  cells.push_back(std::to_string(count_of(row, "failed")));
  return cells;
}

bool one_training(const Json& row) { return text_of(row, "training_tag") == kOneTraining; }

std::string group_lines(const Json& group, bool show_steps) {
  Extra extra;
  extra.steps = show_steps;
  extra.instances = over_different_instances(group);
  for (const Json& row : group["rows"]) extra.yield = extra.yield || !object_of(row, "yield").empty();
  Cells head = {"method", "error", "(quartiles)", "machine s", "ms/step"};
  if (!extra.yield && !extra.instances) head.insert(head.begin() + 3, "commanded");
  if (extra.yield) head.emplace_back("in spec");
  if (extra.instances) head.emplace_back("instances");
  if (extra.steps) head.emplace_back("steps");
  head.emplace_back("failed");
  std::vector<Cells> lines = {head};
  std::vector<std::string> marks = {""};  // after the name, never clipped
  for (const Json& row : group["rows"]) {
    lines.push_back(row_cells(row, extra));
    marks.push_back(std::string(flag_of(row, "oracle") ? " (oracle)" : "") + (one_training(row) ? " *" : ""));
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

  const std::uint64_t instances = count_of(group, "instances");
  std::string out = terminal_text(text_of(group, "scene")) + ", " + terminal_text(text_of(group, "noise_level")) +
                    ", " + terminal_text(text_of(group, "protocol")) + ", " + std::to_string(instances) +
                    (instances == 1 ? " instance" : " instances");
  if (group["start"].is_number()) out += ", median error at the start " + number_or_dash(group["start"], 3);
  if (flag_of(group, "measured_only")) out += ", measured only";
  out = clipped(out, kMaxColumns) + "\n";
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const Cells& line = lines[k];
    std::string text = "  " + padded(clipped(line[0], name_room - columns(marks[k])) + marks[k], widths[0], false);
    for (std::size_t i = 1; i < line.size(); ++i) text += (i == 2 ? " " : "  ") + padded(line[i], widths[i], i != 2);
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  }
  if (std::any_of(group["rows"].begin(), group["rows"].end(), one_training))
    out += "  * one training: another training of the method may give other results\n";
  if (extra.instances) out += "  medians are over different instances: not a ranking until all methods have the same\n";
  if (const std::string spec = spec_words(group); extra.yield && !spec.empty())
    out += clipped("  spec: " + terminal_text(spec), kMaxColumns) + "\n";
  return out;
}

}  // namespace

namespace {

bool by_own_rule(const Json& data) { return text_of(data, "rule").empty() || text_of(data, "rule") == "own"; }

}  // namespace

std::string ranking_table(const Json& data) {
  const Json& ran = data["ran"];
  std::string counts = std::to_string(count_of(ran, "finished")) + " of " + std::to_string(count_of(ran, "planned")) +
                       " trials finished";
  if (count_of(ran, "failed") > 0) counts += ", " + std::to_string(count_of(ran, "failed")) + " failed";
  if (data["groups"].empty()) return counts + ", nothing to rank yet.\n";

  unsigned least = data["steps"].front().get<unsigned>(), most = data["steps"].back().get<unsigned>();
  const auto measured_only = [](const Json& group) { return flag_of(group, "measured_only"); };
  const Json& groups = data["groups"];
  std::string out;
  if (!std::all_of(groups.begin(), groups.end(), measured_only))
    out += (by_own_rule(data) ? std::string("Error: noise-free RMSE at the recommended pose after the last step")
                              : "Error: noise-free RMSE at " + std::string(rule_text(text_of(data, "rule")))) +
           ", median over instances\n";
  if (std::any_of(groups.begin(), groups.end(), measured_only))
    out += "Error, if measured only: lowest measured RMSE, since a station has no ground truth\n";
  if (least == most) out += "steps: " + std::to_string(most) + "   ";
  out += counts + "\n";
  for (const Json& group : data["groups"]) out += "\n" + group_lines(group, least != most);
  return out;
}

}  // namespace relign::report
