// The ranking table: a block per scene, noise level and protocol, one row per method; and each criterion by itself.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/matrix_data.h"
#include "report/residual_text.h"
#include "report/rules_data.h"
#include "report/sections.h"
#include "report/spec_words.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxRowsExplained = 500;  // limits the size of the page

using RankingColumn = ColumnOf<Row>;

// Yields are in whole percent, about the resolution of a share of a hundred instances.
Cell yield_cell(const Row& row) {
  if (!row.yield) return no_cell();
  Cell cell = share_cell(row.yield->share, row.yield->interval);
  if (row.yield->uncured) cell.hint = "Before curing: " + whole_percent(row.yield->uncured->share) + " %";
  return cell;
}

Cell residual_cell(const Row& row) {
  const Residual residual = residual_of(row.residual);
  return {residual.text, residual.sort, "number", residual.details};
}

Cell mtf_cell(const Row& row) {
  if (!row.mtf) return no_cell();
  return {number_text(row.mtf->centre.median, 2) + " / " + number_text(row.mtf->corner.median, 2),
          sort_value(row.mtf->corner.median), "number"};
}

std::string error_unit(const PageModel& page) {
  std::size_t intervals = 0, quartiles = 0;
  for (const Group& group : page.groups)
    for (const Row& row : group.rows)
      if (row.has_score()) ++(row.score().interval.exists() ? intervals : quartiles);
  if (intervals == 0) return "median (quartiles)";
  return quartiles == 0 ? "median (95 % interval)" : "median (95 % interval, else quartiles)";
}

// With what it compares: "RMSE to the reference image", "insertion loss in dB".
std::string score_text(const PageModel& page) {
  const SceneScore score = common_score(page);
  return score.label() + (score.squared ? " to the reference image" : "");
}

// Columns without any value are left out, as are those of noise-free errors without ground truth.
struct RankingColumns {
  const PageModel& page;
  SceneWords words = common_words(page);
  std::vector<RankingColumn> list = {};

  void add(bool shown, RankingColumn column) {
    if (shown) list.push_back(std::move(column));
  }
  void add_specification();
  void add_errors();
  void add_effort();
};

void RankingColumns::add_specification() {
  const bool times = any_row(page, &Row::to_spec);
  const bool mtf = any_group(page, [](const Group& group) { return group.spec.limits_mtf(); });
  const auto of_time = [](double TimeToSpec::*seconds) {
    return [seconds](const Row& row) { return row.to_spec ? number_cell((*row.to_spec).*seconds) : no_cell(); };
  };
  add(true, {{"method", "", "The name given in the suite", "name"},
             [](const Row& row) { return method_cell(row.method, row.oracle(), row.training_tag); }});
  add(any_row(page, &Row::yield),
      {{"in spec", "of instances (95 %)",
        "Yield: share of all instances whose final pose meets the specification; failed trials count as missed",
        "number"},
       yield_cell});
  add(times, {{"moves to spec", "median (95 %)",
               "Number of moves, each with " + words.a_capture() +
                   ", until the recommended pose first meets the specification" +
                   (mtf ? " of the score; an instance whose MTF misses it at the end counts as not reached. "
                        : ". Later recommendations may miss it again; 'in spec' is evaluated at the end. ") +
                   "'not reached': fewer than half of the instances reach it",
               "number"},
              moves_cell});
  add(times, {{"time to spec", "s", "Machine time until then, median", "number"}, of_time(&TimeToSpec::seconds)});
  add(any_row(page, [](const Row& row) { return row.to_spec && !std::isnan(row.to_spec->cycle); }),
      {{"cycle", "s",
        "Time to spec with load, dispense, cure and inspect of the suite's cycle, and the method's own computing time "
        "if the cycle counts it; median",
        "number"},
       of_time(&TimeToSpec::cycle)});
}

void RankingColumns::add_errors() {
  const bool ground_truth = !every_group(page, &Group::measured_only), spec = any_row(page, &Row::yield);
  add(true, {{ground_truth ? "final error" : "lowest measured error", error_unit(page),
              ground_truth ? "Noise-free " + score_text(page) + " at " + rule_text(page.rule) +
                                 " after the last step. Lower is better, 0 is perfect"
                           : "Lowest measured " + score_text(page) + ", noise included. Lower is better",
              "number"},
             error_cell});
  for (RankingColumn& column : final_columns(page)) list.push_back(std::move(column));
  add(any_row(page, &Row::mtf),
      {{"MTF", "centre / corner, median",
        std::string("MTF of the lens, ") + (page.groups.empty() ? "" : mtf_kind(page.groups.front().spec)) +
            ", at the frequency of the specification and the final pose: at the centre of the field, and at the worst "
            "of its corners. Higher is better",
        "number"},
       mtf_cell});
  const bool tilts =
      !any_row(page, [](const Row& row) { return !row.residual.empty() && !has_positions_and_tilts(row.residual); });
  add(any_row(page, [](const Row& row) { return !row.residual.empty(); }),
      {{"residual misalignment", tilts ? "position / tilt, worst axis" : "worst axis (of its travel)",
        std::string("Distance of the recommended pose from the instance's optimum, on the axis with the largest "
                    "median") +
            (tilts ? "" : " as a share of its travel; if all axes are in mm or degrees, the worst position and tilt") +
            ". Tooltips list all axes",
        "number"},
       residual_cell});
  add(!spec, {{"", "middle half of the instances",
               "Dot: median. Bar: interquartile range. The scale of a block starts at 0", "range"},
              [](const Row& row) {
                return Cell{"", sort_value(row.score().median), "range"};
              }});
  add(!spec && ground_truth,
      {{"last commanded pose", "median error", "Noise-free " + common_score(page).name + " at the pose commanded last",
        "number"},
       [](const Row& row) { return row.has_score() ? number_cell(row.commanded.median) : no_cell(); }});
}

void RankingColumns::add_effort() {
  add(true, {{"machine time", "s",
              every_group(page, &Group::station)
                  ? "Of all moves and " + words.captures() + ", as recorded by the station; median"
                  : "Simulated travel, settling, exposure, readout and the move to the "
                    "recommended pose; median",
              "number"},
             [](const Row& row) { return number_cell(row.machine_seconds); }});
  add(true,
      {{"compute time", "ms per step", "Host time of the algorithm, median; comparable on one machine only", "number"},
       [](const Row& row) { return number_cell(row.algorithm_ms_per_step, 2); }});
  add(true,
      {{"steps", "",
        "Step budget, after which the error is evaluated. A step is one move and one " + words.capture + "; the " +
            words.capture + " at the start is step 0. A method that ends earlier keeps its last recommendation",
        "number"},
       [](const Row& row) { return number_cell(row.has_score() ? std::to_string(row.step) : "-"); }});
  add(true,
      {{"failed", "trials", "Trials that ended in an error; excluded from the medians", "number"}, [](const Row& row) {
         return Cell{std::to_string(row.failed), std::nullopt, row.failed == 0 ? "number" : "number bad"};
       }});
  add(true, {{"observes", "", "What the method may observe besides its own moves", "observes"}, [this](const Row& row) {
               return Cell{words.observed(join(row.observes, ", ")), std::nullopt, "observes"};
             }});
}

}  // namespace

std::vector<ColumnOf<Row>> final_columns(const PageModel& page, const statistics::FinalStatistics& statistics) {
  std::vector<ColumnOf<Row>> columns;
  if (every_group(page, &Group::measured_only)) return columns;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    const statistics::FinalStatistic& one = statistics[k];
    const bool intervals = any_row(page, [k](const Row& row) { return row.finals[k].interval.exists(); });
    if (one.in_ranking)
      columns.push_back(
          {{one.title, std::string(one.unit) + (intervals ? " (95 %)" : ""), one.hint, "number"}, [k](const Row& row) {
             const statistics::Band& band = row.finals[k];
             if (!std::isfinite(band.estimate)) return no_cell();
             return estimate_cell(band.estimate, number_text(band.estimate, 3), interval_text(band.interval, 3, kDash));
           }});
  }
  return columns;
}

namespace {

Words group_title(const Group& group) {
  std::string rest = (group.station ? " \u00b7 station" : " \u00b7 " + group.scene) + " \u00b7 protocol " +
                     group.protocol + " \u00b7 " + counted(group.instances, "instance");
  if (std::isfinite(group.start)) rest += " \u00b7 median error at the start " + number_text(group.start, 3);
  if (std::isfinite(group.own_optimum))
    rest += " \u00b7 best possible " + excess_text(group.own_optimum, group.scored_by);
  if (group.measured_only)
    rest += group.station ? " \u00b7 measured only: a station has no ground truth"
                          : " \u00b7 measured only: this scene has no ground truth";
  return {{group.station ? group.scene : group.noise_level, "name"}, {rest, "quiet"}};
}

}  // namespace

Cell error_cell(const Row& row) {
  if (!row.has_score()) return no_cell("number error");
  const Score& error = row.score();
  const bool quartiles = !error.interval.exists() && error.n != 1;
  Cell cell =
      estimate_cell(error.median, number_text(error.median, 3),
                    interval_text(quartiles ? statistics::Interval{error.q25, error.q75} : error.interval, 3, kDash));
  cell.kind = "number error";
  return cell;
}

Cell moves_cell(const Row& row) {
  if (!row.to_spec) return no_cell();
  const auto shown = [](double moves) { return shortest(rounded(moves, 3)); };  // without trailing zeros
  const double steps = row.to_spec->steps;
  const statistics::Interval& interval = row.to_spec->interval;
  if (!std::isfinite(steps)) return arrival_cell(steps, interval);
  return estimate_cell(
      steps, shown(steps),
      !std::isfinite(interval.low)
          ? ""
          : shown(interval.low) + (std::isfinite(interval.high) ? kDash + shown(interval.high) : " or more"));
}

void ranking_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  if (page.groups.empty()) return;
  RankingColumns all{page};
  all.add_specification();
  all.add_errors();
  all.add_effort();
  const std::vector<RankingColumn>& columns = all.list;
  Table table{"ranking", "", {columns.begin(), columns.end()}};
  std::size_t index = 0, count = 0;
  for (const Group& group : page.groups) count += group.rows.size();
  for (const Group& group : page.groups) {
    const std::string& best = page.verdict[index++].best;
    double scale = 0;  // the largest upper quartile
    for (const Row& row : group.rows)
      if (row.has_score()) scale = std::max(scale, row.score().q75);
    const auto add = [&](const Row& row, bool is_best) {
      std::vector<Cell> cells;
      for (const RankingColumn& column : columns) {
        cells.push_back(column.cell(row));
        if (column.kind == "range" && row.has_score() && scale > 0)
          cells.back().range = {row.score().q25 / scale, row.score().median / scale, row.score().q75 / scale};
      }
      if (count > kMaxRowsExplained)
        for (Cell& cell : cells) cell.hint.clear();
      table.add(std::move(cells), is_best ? "best" : row.oracle() ? "oracle" : "");
    };
    table.add_title(group_title(group), "group");
    const std::vector<ObservationClass> classes = classes_in(group.rows);
    const bool blocks = std::count_if(classes.begin(), classes.end(), [](ObservationClass one) {
                          return one != ObservationClass::oracle && one != ObservationClass::unknown;
                        }) > 1;
    // A block per class: methods with different observations are not comparable.
    for (const ObservationClass of_class : blocks ? classes : std::vector{ObservationClass::unknown}) {
      if (blocks) table.add_title(group.words.observed(class_title(of_class)), "class");
      bool first = of_class != ObservationClass::oracle;
      for (const Row& row : group.rows) {
        if (blocks && row.of_class != of_class) continue;
        const bool is_best = blocks ? first && row.has_score() : row.method == best;
        first = first && !is_best;
        add(row, is_best);
      }
    }
  }
  out.heading(2, "Ranking").table(table);
  out.text("Click a column title to sort each block. Bold row: lowest median error of the block, oracles excluded.",
           "quiet noprint");
}

void further_scores_section(PageWriter& out, const PageParts& parts) {
  const auto measured = [](const Row& row) { return !row.further.empty(); };
  if (!any_row(parts.page, measured)) return;
  out.heading(3, "Further scores")
      .text(
          "Noise-free, of the pose that the method recommends at the end, the better the lower: median with its 95 % "
          "interval. The ranking does not use them.",
          "facts");
  for (const Group& group : parts.page.groups) {
    if (std::none_of(group.rows.begin(), group.rows.end(), measured)) continue;
    Table table{"", group.label, {{"method"}}};
    for (const FurtherScore& score : group.scored_by.further) table.heads.push_back({score.name, score.unit});
    const auto add = [&table](const Cell& name, const std::vector<statistics::Band>& medians) {
      std::vector<Cell> cells = {name};
      for (const statistics::Band& median : medians)
        cells.push_back(median.n == 0 ? no_cell()
                                      : estimate_cell(median.estimate, number_text(median.estimate, 3),
                                                      interval_text(median.interval, 3, kDash)));
      table.bodies.back().push_back({std::move(cells)});
    };
    for (const Row& row : group.rows)
      if (!row.further.empty()) add(method_cell(row.method, row.oracle(), row.training_tag), row.further);
    if (!group.further_at_optimum.empty())
      add({"at the optimum of the " + group.scored_by.name}, group.further_at_optimum);
    out.table(table);
  }
}

void specification_section(PageWriter& out, const PageParts& parts) {
  const auto judged = [](const Row& row) { return !row.to_specification.empty(); };
  if (!any_row(parts.page, judged)) return;
  const SceneWords words = common_words(parts.page);
  const auto of_distance = [](const Group& group) {
    return std::any_of(kCriteria.begin(), kCriteria.end(), [&](Criterion one) {
      return entry_of(one).needs == CriterionNeeds::own_optimum && !std::isnan(group.spec.limits[one]);
    });
  };
  out.heading(3, "To specification")
      .text("Each criterion is judged noise-free after every " + words.capture +
                ", where the recommended pose leaves the " + words.device + "; 'all' at one " + words.capture + ". " +
                (any_group(parts.page, of_distance)
                     ? "Position and tilt are distances from the instance's optimum over the observable axes. "
                     : "") +
                "In spec: at the end. Each move ends with one " + words.capture + "; the " + words.capture +
                " at the start does not count. Medians with 95 % intervals; 'not reached': by fewer than half of the "
                "instances.",
            "facts");
  for (const Group& group : parts.page.groups) {
    if (std::none_of(group.rows.begin(), group.rows.end(), judged)) continue;
    Table table{"", group.label, {{"method"}, {"criterion"}, {"in spec"}, {"moves to spec"}, {"time to spec, s"}}};
    for (const Row& row : group.rows)
      for (const CriterionScore& score : row.to_specification)
        table.add({method_cell(row.method, row.oracle(), row.training_tag),
                   {criterion_words(score.name, group.spec, group.scored_by), std::nullopt, "",
                    criterion_meaning(score.name)},
                   share_cell(score.share.share, score.share.interval),
                   arrival_cell(score.time.steps, score.time.interval),
                   arrival_cell(score.time.seconds, score.seconds)});
    out.table(table);
  }
}

}  // namespace relign::report
