// The ranking table: a block per scene, noise level and protocol, one row per method.
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/residual_text.h"
#include "report/rules_data.h"
#include "report/sections.h"
#include "report/spec_words.h"

namespace relign::report {
namespace {

// Properties of a block that cells need.
struct Block {
  double scale = 0;       // the largest upper quartile: end of the scale
  bool explained = true;  // cells have titles
};

struct RankingColumn {
  std::string title, unit, hint;
  const char* kind;  // class of its head and cells
  std::function<void(HtmlWriter&, const Row& row, const Block&)> cell;
};

constexpr std::size_t kMaxRowsExplained = 500;  // limits the size of the page
constexpr const char* kTo = "\u2013";

void number_cell(HtmlWriter& html, const std::string& text) { html.element("td", {{"class", "number"}}, text); }

void empty_cell(HtmlWriter& html, const char* kind = "number") { interval_cell(html, kind, "", "-", ""); }

// Yields are in whole percent, about the resolution of a share of a hundred instances.
void ranking_yield_cell(HtmlWriter& html, const Row& row, const Block&) {
  if (!row.yield) return empty_cell(html);
  const Yield& yield = *row.yield;
  interval_cell(html, "number", sort_value(yield.share), whole_percent(yield.share) + " %",
                whole_percent(yield.interval.low) + kTo + whole_percent(yield.interval.high),
                yield.uncured ? "Before curing: " + whole_percent(yield.uncured->share) + " %" : "");
}

// Without trailing zeros.
std::string images_text(double images) { return shortest(rounded(images, 3)); }

void images_cell(HtmlWriter& html, const Row& row, const Block&) {
  if (!row.to_spec || std::isnan(row.to_spec->steps)) return empty_cell(html, row.to_spec ? "number quiet" : "number");
  const double steps = row.to_spec->steps;
  const statistics::Interval& interval = row.to_spec->interval;
  if (std::isinf(steps)) return interval_cell(html, "number quiet", "", "not reached", "");
  std::string text;
  if (std::isfinite(interval.low))
    text = images_text(interval.low) + (std::isfinite(interval.high) ? kTo + images_text(interval.high) : " or more");
  interval_cell(html, "number", sort_value(steps), images_text(steps), text);
}

void ranking_error_cell(HtmlWriter& html, const Row& row, const Block&) {
  if (!row.has_score()) return empty_cell(html, "number error");
  const Score& error = row.score();
  std::string interval = interval_text(error.interval, 3, kTo);
  if (interval.empty() && error.n != 1) interval = interval_text({error.q25, error.q75}, 3, kTo);
  interval_cell(html, "number error", sort_value(error.median), number_text(error.median, 3), interval);
}

// A bar from the lower to the upper quartile with a dot at the median.
void ranking_range_cell(HtmlWriter& html, const Row& row, const Block& block) {
  constexpr double kWidth = 150;
  const Score& error = row.score();
  html.open("td", {{"class", "range"}, {"data-sort", sort_value(error.median)}});
  if (row.has_score() && block.scale > 0) {
    const auto x = [&](double value) { return significant(5 + (kWidth - 10) * value / block.scale, 4); };
    html.open("svg", {{"viewBox", "0 0 150 14"}, {"width", "150"}, {"height", "14"}, {"aria-hidden", "true"}});
    html.empty("line", {{"x1", "5"}, {"x2", "145"}, {"y1", "7"}, {"y2", "7"}, {"class", "scale"}});
    html.empty("line", {{"x1", x(error.q25)}, {"x2", x(error.q75)}, {"y1", "7"}, {"y2", "7"}, {"class", "bar"}});
    html.empty("circle", {{"cx", x(error.median)}, {"cy", "7"}, {"r", "4"}});
    html.close();
  }
  html.close();
}

void residual_cell(HtmlWriter& html, const Row& row, const Block& block) {
  const Residual residual = residual_of(row.residual);
  Attributes attributes = {{"class", "number"}, {"data-sort", residual.sort}};
  if (block.explained) attributes.emplace_back("title", residual.details);
  html.element("td", attributes, residual.text);
}

void mtf_cell(HtmlWriter& html, const Row& row, const Block&) {
  if (!row.mtf) return empty_cell(html);
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(row.mtf->corner.median)}},
               number_text(row.mtf->centre.median, 2) + " / " + number_text(row.mtf->corner.median, 2));
}

void failed_cell(HtmlWriter& html, const Row& row, const Block&) {
  html.element("td", {{"class", row.failed == 0 ? "number" : "number bad"}}, std::to_string(row.failed));
}

std::string error_unit(const PageModel& page) {
  std::size_t intervals = 0, quartiles = 0;
  for (const Group& group : page.groups)
    for (const Row& row : group.rows)
      if (row.has_score()) ++(row.score().interval.exists() ? intervals : quartiles);
  if (intervals == 0) return "median (quartiles)";
  return quartiles == 0 ? "median (95 % interval)" : "median (95 % interval, else quartiles)";
}

// Columns without any value are left out, as are those of noise-free errors without ground truth.
std::vector<RankingColumn> columns_of(const PageModel& page) {
  const bool ground_truth = !every_group(page, &Group::measured_only), spec = any_row(page, &Row::yield);
  std::vector<RankingColumn> columns;
  if (spec)
    columns.push_back(
        {"in spec", "of instances (95 %)",
         "Yield: share of all instances whose final pose meets the specification; failed trials count as missed",
         "number", ranking_yield_cell});
  if (any_row(page, &Row::to_spec)) {
    const bool mtf = any_group(page, [](const Group& group) { return group.spec.limits_mtf(); });
    columns.push_back(
        {"moves to spec", "median (95 %)",
         std::string("Number of moves, each with an image, until the recommended pose first meets the specification") +
             (mtf ? " of RMSE; an instance whose MTF misses it at the end counts as not reached. "
                  : ". Later recommendations may miss it again; 'in spec' is evaluated at the end. ") +
             "'not reached': fewer than half of the instances reach it",
         "number", images_cell});
    columns.push_back({"time to spec", "s", "Machine time until then, median", "number",
                       [](HtmlWriter& html, const Row& row, const Block&) {
                         number_cell(html, row.to_spec ? number_text(row.to_spec->seconds, 3) : "-");
                       }});
    if (any_row(page, [](const Row& row) { return row.to_spec && !std::isnan(row.to_spec->cycle); }))
      columns.push_back(
          {"cycle", "s",
           "Time to spec with load, dispense, cure and inspect of the suite's cycle, and the method's own "
           "computing time if the cycle counts it; median",
           "number", [](HtmlWriter& html, const Row& row, const Block&) {
             number_cell(html, row.to_spec ? number_text(row.to_spec->cycle, 3) : "-");
           }});
  }
  columns.push_back(
      {ground_truth ? "final error" : "lowest measured error", error_unit(page),
       ground_truth ? "Noise-free RMSE to the reference image at " + std::string(rule_text(page.rule)) +
                          " after the last step. Lower is better, 0 is identical"
                    : "Lowest RMSE between an image of the trial and the reference image, camera noise included. Lower "
                      "is better",
       "number", ranking_error_cell});
  if (any_row(page, &Row::mtf))
    columns.push_back(
        {"MTF", "centre / corner, median",
         std::string("MTF of the lens, ") + mtf_kind(page.groups.front().spec) +
             ", at the frequency of the specification and the final pose: at the centre of the field, and "
             "at the worst of its corners. Higher is better",
         "number", mtf_cell});
  if (any_row(page, [](const Row& row) { return !row.residual.empty(); }))
    columns.push_back({"residual misalignment", "position / tilt, worst axis",
                       "Distance of the recommended pose from the instance's own optimum, on the axis with the largest "
                       "median. Tooltips list all axes",
                       "number", residual_cell});
  if (!spec) {
    columns.push_back({"", "middle half of the instances",
                       "Dot: median. Bar: interquartile range. The scale of a block starts at 0", "range",
                       ranking_range_cell});
    if (ground_truth)
      columns.push_back({"last commanded pose", "median error", "Noise-free RMSE at the pose commanded last", "number",
                         [](HtmlWriter& html, const Row& row, const Block&) {
                           number_cell(html, row.has_score() ? number_text(row.commanded.median, 3) : "-");
                         }});
  }
  columns.push_back(
      {"machine time", "s",
       every_group(page, &Group::station) ? "Of all moves and images, as recorded by the station; median"
                                          : "Simulated travel, settling, exposure, readout and the move to the "
                                            "recommended pose; median",
       "number",
       [](HtmlWriter& html, const Row& row, const Block&) { number_cell(html, number_text(row.machine_seconds, 3)); }});
  columns.push_back({"compute time", "ms per step",
                     "Host time of the algorithm, median; comparable on one machine only", "number",
                     [](HtmlWriter& html, const Row& row, const Block&) {
                       number_cell(html, number_text(row.algorithm_ms_per_step, 2));
                     }});
  columns.push_back({"steps", "",
                     "Step budget, after which the error is evaluated. A step is one move and one image; the image "
                     "at the start is step 0. A method that ends earlier keeps its last recommendation",
                     "number", [](HtmlWriter& html, const Row& row, const Block&) {
                       number_cell(html, row.has_score() ? std::to_string(row.step) : "-");
                     }});
  columns.push_back(
      {"failed", "trials", "Trials that ended in an error; excluded from the medians", "number", failed_cell});
  columns.push_back({"observes", "", "What the method may observe besides its own moves", "observes",
                     [](HtmlWriter& html, const Row& row, const Block&) {
                       html.element("td", {{"class", "observes"}}, join(row.observes, ", "));
                     }});
  return columns;
}

void ranking_row(HtmlWriter& html, const std::vector<RankingColumn>& columns, const Row& row, bool best,
                 const Block& block) {
  html.open("tr", {{"class", best ? "best" : row.oracle() ? "oracle" : "plain"}});
  method_cell(html, row.method, row.oracle(), row.training_tag);
  for (const RankingColumn& column : columns) column.cell(html, row, block);
  html.close();
}

void table_group(HtmlWriter& html, const std::vector<RankingColumn>& columns, const Group& group,
                 const std::string& best, bool explained) {
  html.open("tbody").open("tr", {{"class", "group"}});
  html.open("th", {{"colspan", std::to_string(columns.size() + 1)}, {"scope", "rowgroup"}});
  html.element("bdi", group.station ? group.scene : group.noise_level);
  std::string rest = (group.station ? " \u00b7 station" : " \u00b7 " + group.scene) + " \u00b7 protocol " +
                     group.protocol + " \u00b7 " + counted(group.instances, "instance");
  if (std::isfinite(group.start)) rest += " \u00b7 median error at the start " + number_text(group.start, 3);
  if (group.measured_only)
    rest += group.station ? " \u00b7 measured only: a station has no ground truth"
                          : " \u00b7 measured only: this scene has no ground truth";
  html.element("span", {{"class", "quiet"}}, rest).close().close();
  Block block;
  block.explained = explained;
  for (const Row& row : group.rows)
    if (row.has_score()) block.scale = std::max(block.scale, row.score().q75);
  const std::vector<ObservationClass> classes = classes_in(group.rows);
  const auto ranked = std::count_if(classes.begin(), classes.end(), [](ObservationClass one) {
    return one != ObservationClass::oracle && one != ObservationClass::unknown;
  });
  if (ranked < 2) {
    for (const Row& row : group.rows) ranking_row(html, columns, row, row.method == best, block);
    html.close();
    return;
  }
  // A block per class: methods with different observations are not comparable.
  html.close();
  for (const ObservationClass of_class : classes) {
    html.open("tbody").open("tr", {{"class", "class"}});
    html.element("th", {{"colspan", std::to_string(columns.size() + 1)}, {"scope", "rowgroup"}}, class_title(of_class));
    html.close();
    bool first = of_class != ObservationClass::oracle;
    for (const Row& row : group.rows)
      if (row.of_class == of_class) {
        ranking_row(html, columns, row, first && row.has_score(), block);
        first = first && !row.has_score();
      }
    html.close();
  }
}

}  // namespace

std::string ranking_section(const PageModel& page) {
  if (page.groups.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Ranking").open("div", {{"class", "scroll"}}).open("table", {{"class", "ranking sortable"}});
  html.open("thead").open("tr");
  const std::vector<RankingColumn> columns = columns_of(page);
  column_head(html, "name", "method", "", "The name given in the suite");
  for (const RankingColumn& column : columns) column_head(html, column.kind, column.title, column.unit, column.hint);
  html.close().close();
  std::size_t index = 0, rows = 0;
  for (const Group& group : page.groups) rows += group.rows.size();
  for (const Group& group : page.groups)
    table_group(html, columns, group, page.verdict[index++].best, rows <= kMaxRowsExplained);
  html.close().close();
  html.element("p", {{"class", "quiet noprint"}},
               "Click a column title to sort each block. Bold: lowest median of the block, oracles excluded.");
  return html.take();
}

}  // namespace relign::report
