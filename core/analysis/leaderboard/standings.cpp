#include "leaderboard/standings.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"

namespace relign::leaderboard {
namespace {

using report::Cell;
using report::estimate_cell;
using report::interval_text;
using report::number_text;
using report::sort_value;
using report::Words;

Cell name_cell(const Board& board, const Standing& standing, const std::string& root) {
  const std::string rank = standing.rank > 0 ? std::to_string(standing.rank) : "";
  Cell cell = {
      {{rank.empty() ? report::kDash : rank, "rank"}, {" "}, {standing.method, "name", "", root + standing.page}},
      rank,
      "name"};
  if (!standing.training_tag.empty()) cell.words.add(" ").add(standing.training_tag, "tag");
  if (!standing.submitted) return cell;
  const Entry& entry = board.entries[*standing.entry];
  cell.words.add(" ").add("submitted", "mine");
  add_condition_flags(cell.words, entry);
  cell.words.add(" ").add("version " + entry.evaluation.version, "who");
  if (!entry.submission.authors.empty()) cell.words.add(" ").add(join(entry.submission.authors, ", "), "who");
  return cell;
}

Cell replayed_cell(const Standing& standing) {
  const records::ReplayCounts& replays = standing.replays;
  if (replays.replayed == 0) return {"not replayed", "0", "number quiet", standing.replayed_by};
  return {Words(std::to_string(replays.replayed) + " of " + std::to_string(replays.recorded))
              .add(" ")
              .add(standing.replayed_by, "who"),
          std::to_string(replays.replayed), "number", standing.replayed_by};
}

Cell band_cell(const statistics::Band& share) {
  return share.n == 0 ? report::no_cell() : report::share_cell(share.estimate, share.interval);
}

}  // namespace

std::string class_title(const BoardClass& of_class) {
  if (of_class.oracles) return "Oracles";
  return of_class.observes.empty() ? "Observes nothing but its own moves" : "Observes " + join(of_class.observes, ", ");
}

std::string error_text(const statistics::Band& error) {
  if (error.n == 0) return "-";
  const std::string interval = interval_text(error.interval, 3, report::kDash);
  return number_text(error.estimate, 3) + (interval.empty() ? "" : " (" + interval + ")");
}

std::string training_text(const std::optional<TrainingCost>& training) {
  if (!training) return "none";
  std::vector<std::string> parts;
  if (std::isfinite(training->hours)) parts.push_back(number_text(training->hours, 3) + " h");
  if (std::isfinite(training->images)) parts.push_back(shortest(training->images) + " images");
  if (std::isfinite(training->steps)) parts.push_back(shortest(training->steps) + " steps");
  if (!training->hardware.empty()) parts.push_back(training->hardware);
  return parts.empty() ? "not stated" : join(parts, ", ");
}

void add_condition_flags(Words& words, const Entry& entry) {
  for (const Caution& caution : entry.cautions) words.add(" ").add(caution.tag, "flag", caution.text);
}

void add_failure_flag(Words& words, std::size_t failed, std::size_t trials) {
  if (failed > 0)
    words.add(" ").add(std::to_string(failed) + " of " + counted(trials, "trial") + " failed", "flag",
                       "Each counts as error 1.");
}

Cell failed_cell(std::size_t failed, std::size_t trials) {
  return {std::to_string(failed) + " of " + std::to_string(trials), std::to_string(failed),
          failed > 0 ? "number bad" : "number"};
}

report::Table standings_table(const Board& board, const std::string& caption) {
  return {"ranking",
          caption,
          {{"method", "rank", "By the interquartile mean of the normalised error", "name"},
           {"normalised error", "IQM (95 %)",
            "Interquartile mean over all instances, every scene and noise level with equal weight. 0: the instance's "
            "optimum; 1: no better than the start. A failed trial counts as 1",
            "number"},
           {"", "0 to 1", "The same on a scale from 0 to 1", "range"},
           {"better than " + board.baseline, "of instances (95 %)",
            "Probability to end with a lower error than this method on the same instance; ties count half", "number"},
           {"behind the first", "of instances (95 %)",
            "Probability that the first of the class ends with a lower error on the same instance. An interval that "
            "includes 50 % does not separate the two",
            "number"},
           {"failed", "trials", "Trials that ended in an error; each counts as error 1", "number"},
           {"captures", "median", "Captures that the method took per alignment", "number"},
           {"time", "s, median", "Machine time of one alignment and the method's own computing time", "number"},
           {"replayed", "trials",
            "Trials that 'relign-bench verify' ran again with equal numbers, by whom and with which version, as "
            "verify.json beside these records states",
            "number"},
           {"training", "hours", "Machine time of training, once", "number"}}};
}

void add_standing(report::Table& table, const Board& board, const BoardClass& of_class, const Standing& standing,
                  const std::string& root) {
  std::vector<Cell> cells = {name_cell(board, standing, root)};
  if (standing.error.n == 0) {
    Cell& cell = cells.emplace_back(Cell{"no aggregate: " + standing.not_ranked});
    cell.kind = "quiet words";
    cell.span = 4;
  } else {
    cells.push_back(estimate_cell(standing.error.estimate, number_text(standing.error.estimate, 3),
                                  interval_text(standing.error.interval, 3, report::kDash)));
    cells.push_back(report::range_cell(standing.error));
    cells.push_back(band_cell(standing.beats_baseline));
    cells.push_back(band_cell(standing.beaten_by_best));
  }
  const double images = std::isfinite(standing.images) ? report::rounded(standing.images, 4) : standing.images;
  cells.push_back(failed_cell(standing.failed, standing.trials));
  cells.push_back({std::isfinite(images) ? shortest(images) : "-", sort_value(images), "number"});
  cells.push_back(report::number_cell(standing.seconds(), 3));
  cells.push_back(replayed_cell(standing));
  cells.push_back({standing.training ? number_text(standing.training->hours, 3) : "none",
                   standing.training ? sort_value(standing.training->hours) : "0", "number"});
  table.add(std::move(cells), of_class.oracles ? "oracle" : standing.rank == 1 ? "best" : "");
}

}  // namespace relign::leaderboard
