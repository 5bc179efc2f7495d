// The ranking table: a block per scene, noise level and protocol, one row per method.
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/page_data.h"
#include "report/page_groups.h"
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
  std::function<void(HtmlWriter&, const Json& row, const Block&)> cell;
};

constexpr std::size_t kMaxRowsExplained = 500;  // limits the size of the page
constexpr const char* kTo = "\u2013";

bool has_score(const Json& row) { return score_of(row)["n"] != 0; }

void number_cell(HtmlWriter& html, const Json& number, int digits) {
  html.element("td", {{"class", "number"}}, number_text(number, digits));
}

void cell_with_interval(HtmlWriter& html, const std::string& kind, const std::string& sort, const std::string& value,
                        const std::string& interval, const std::string& title = "") {
  Attributes attributes = {{"class", kind}, {"data-sort", sort}};
  if (!title.empty()) attributes.emplace_back("title", title);
  html.open("td", attributes).element("b", value);
  if (!interval.empty()) html.text(" ").element("span", {{"class", "quartiles"}}, "(" + interval + ")");
  html.close();
}

// Whole percent, about the resolution of a share of a hundred instances.
std::string whole_percent(const Json& share) {
  return share.is_number() ? std::to_string(std::lround(100 * share.get<double>())) : "?";
}

void ranking_yield_cell(HtmlWriter& html, const Json& row, const Block&) {
  const Json& yield = object_of(row, "yield");
  if (yield.empty() || !yield.value("share", Json()).is_number())
    return cell_with_interval(html, "number", "", "-", "");
  const Json& uncured = object_of(yield, "uncured");
  cell_with_interval(
      html, "number", sort_value(yield["share"]), whole_percent(yield["share"]) + " %",
      yield.value("lo95", Json()).is_number() ? whole_percent(yield["lo95"]) + kTo + whole_percent(yield["hi95"]) : "",
      uncured.empty() ? "" : "Before curing: " + whole_percent(uncured["share"]) + " %");
}

// Without trailing zeros.
std::string images_text(const Json& images) { return shortest(rounded(images.get<double>(), 3)); }

void images_cell(HtmlWriter& html, const Json& row, const Block&) {
  const Json& to_spec = object_of(row, "to_spec");
  if (to_spec.empty()) return cell_with_interval(html, "number", "", "-", "");
  const Json steps = to_spec.value("steps", Json()), low = to_spec.value("lo95", Json()),
             high = to_spec.value("hi95", Json());
  if (!steps.is_number())  // "never": fewer than half reach it
    return cell_with_interval(html, "number quiet", "", steps.is_string() ? "not reached" : "-", "");
  std::string interval;
  if (low.is_number() && high.is_number())
    interval = images_text(low) + kTo + images_text(high);
  else if (low.is_number())
    interval = images_text(low) + " or more";
  cell_with_interval(html, "number", sort_value(steps), images_text(steps), interval);
}

void ranking_error_cell(HtmlWriter& html, const Json& row, const Block&) {
  const Json& error = score_of(row);
  if (!has_score(row)) return cell_with_interval(html, "number error", "", "-", "");
  std::string interval;
  if (const Json low = error.value("lo95", Json()), high = error.value("hi95", Json());
      low.is_number() && high.is_number())
    interval = number_text(low, 3) + kTo + number_text(high, 3);
  else if (error["n"] != 1)
    interval = number_text(error["q25"], 3) + kTo + number_text(error["q75"], 3);
  cell_with_interval(html, "number error", sort_value(error["median"]), number_text(error["median"], 3), interval);
}

// A bar from the lower to the upper quartile with a dot at the median.
void ranking_range_cell(HtmlWriter& html, const Json& row, const Block& block) {
  constexpr double kWidth = 150;
  const Json& error = score_of(row);
  html.open("td", {{"class", "range"}, {"data-sort", has_score(row) ? sort_value(error["median"]) : ""}});
  if (has_score(row) && block.scale > 0) {
    const auto x = [&](const char* key) {
      return significant(5 + (kWidth - 10) * error[key].get<double>() / block.scale, 4);
    };
    html.open("svg", {{"viewBox", "0 0 150 14"}, {"width", "150"}, {"height", "14"}, {"aria-hidden", "true"}});
    html.empty("line", {{"x1", "5"}, {"x2", "145"}, {"y1", "7"}, {"y2", "7"}, {"class", "scale"}});
    html.empty("line", {{"x1", x("q25")}, {"x2", x("q75")}, {"y1", "7"}, {"y2", "7"}, {"class", "bar"}});
    html.empty("circle", {{"cx", x("median")}, {"cy", "7"}, {"r", "4"}});
    html.close();
  }
  html.close();
}

void residual_cell(HtmlWriter& html, const Json& row, const Block& block) {
  const Residual residual = residual_of(row);
  Attributes attributes = {{"class", "number"}, {"data-sort", residual.sort}};
  if (block.explained) attributes.emplace_back("title", residual.details);
  html.element("td", attributes, residual.text);
}

void mtf_cell(HtmlWriter& html, const Json& row, const Block&) {
  const Json& mtf = object_of(row, "mtf");
  if (mtf.empty()) return cell_with_interval(html, "number", "", "-", "");
  const auto median = [&mtf](const char* point) { return object_of(mtf, point).value("median", Json()); };
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(median("corner"))}},
               number_text(median("centre"), 2) + " / " + number_text(median("corner"), 2));
}

void failed_cell(HtmlWriter& html, const Json& row, const Block&) {
  const std::string failed = std::to_string(count_of(row, "failed"));
  html.element("td", {{"class", failed == "0" ? "number" : "number bad"}}, failed);
}

std::string error_unit(const Json& data) {
  std::size_t intervals = 0, quartiles = 0;
  for (const Json& group : data["groups"])
    for (const Json& row : group["rows"])
      if (has_score(row)) ++(score_of(row).value("lo95", Json()).is_number() ? intervals : quartiles);
  if (intervals == 0) return "median (quartiles)";
  return quartiles == 0 ? "median (95 % interval)" : "median (95 % interval, else quartiles)";
}

// Columns without any value are left out, as are those of noise-free errors without ground truth.
std::vector<RankingColumn> columns_of(const Json& data) {
  const bool ground_truth = !every_group(data, "measured_only"), spec = any_row(data, "yield");
  std::vector<RankingColumn> columns;
  if (spec)
    columns.push_back(
        {"in spec", "of instances (95 %)",
         "Yield: share of all instances whose final pose meets the specification; failed trials count as missed",
         "number", ranking_yield_cell});
  if (any_row(data, "to_spec")) {
    const bool mtf = std::any_of(data["groups"].begin(), data["groups"].end(), judges_mtf);
    columns.push_back({"images to spec", "median (95 %)",
                       std::string("Number of images until the recommended pose first meets the specification") +
                           (mtf ? " of RMSE; an instance whose MTF misses it at the end counts as not reached. "
                                : ". Later recommendations may miss it again; 'in spec' is evaluated at the end. ") +
                           "'not reached': fewer than half of the instances reach it",
                       "number", images_cell});
    columns.push_back({"time to spec", "s", "Machine time until then, median", "number",
                       [](HtmlWriter& html, const Json& row, const Block&) {
                         number_cell(html, object_of(row, "to_spec").value("seconds", Json()), 3);
                       }});
  }
  columns.push_back(
      {ground_truth ? "final error" : "lowest measured error", error_unit(data),
       ground_truth ? "Noise-free RMSE to the reference image at " + std::string(rule_text(text_of(data, "rule"))) +
                          " after the last step. Lower is better, 0 is identical"
                    : "Lowest RMSE between an image of the trial and the reference image, camera noise included. Lower "
                      "is better",
       "number", ranking_error_cell});
  if (any_row(data, "mtf"))
    columns.push_back(
        {"MTF", "centre / corner, median",
         "MTF of the lens, " + mtf_kind(data["groups"].front()) +
             ", at the frequency of the specification and the final pose: at the centre of the field, and "
             "at the worst of its corners. Higher is better",
         "number", mtf_cell});
  if (any_row(data, "residual"))
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
                         [](HtmlWriter& html, const Json& row, const Block&) {
                           number_cell(html, has_score(row) ? row["commanded"].value("median", Json()) : Json(), 3);
                         }});
  }
  columns.push_back({"machine time", "s",
                     every_group(data, "station") ? "Of all moves and images, as recorded by the station; median"
                                                  : "Simulated travel, settling, exposure, readout and the move to the "
                                                    "recommended pose; median",
                     "number", [](HtmlWriter& html, const Json& row, const Block&) {
                       number_cell(html, row["machine_seconds"], 3);
                     }});
  columns.push_back(
      {"compute time", "ms per step", "Host time of the algorithm, median; comparable on one machine only", "number",
       [](HtmlWriter& html, const Json& row, const Block&) { number_cell(html, row["algorithm_ms_per_step"], 2); }});
  columns.push_back({"steps", "",
                     "Step budget, after which the error is evaluated. A step is one move and one image; the image "
                     "at the start is step 0. A method that ends earlier keeps its last recommendation",
                     "number", [](HtmlWriter& html, const Json& row, const Block&) {
                       number_cell(html, has_score(row) ? row["step"] : Json(), 6);
                     }});
  columns.push_back(
      {"failed", "trials", "Trials that ended in an error; excluded from the medians", "number", failed_cell});
  columns.push_back({"observes", "", "What the method may observe besides its own moves", "observes",
                     [](HtmlWriter& html, const Json& row, const Block&) {
                       html.element("td", {{"class", "observes"}}, joined(row["observes"], ", "));
                     }});
  return columns;
}

void ranking_row(HtmlWriter& html, const std::vector<RankingColumn>& columns, const Json& row, bool best,
                 const Block& block) {
  html.open("tr", {{"class", best ? "best" : flag_of(row, "oracle") ? "oracle" : "plain"}});
  html.open("th", {{"scope", "row"}, {"class", "name"}, {"data-sort", text_of(row, "method")}});
  html.element("bdi", text_of(row, "method"));
  if (flag_of(row, "oracle")) html.text(" ").element("span", {{"class", "tag"}}, "oracle");
  if (const std::string tag = text_of(row, "training_tag"); !tag.empty())
    html.text(" ").element("span", {{"class", "tag"}}, tag);
  html.close();
  for (const RankingColumn& column : columns) column.cell(html, row, block);
  html.close();
}

void table_group(HtmlWriter& html, const std::vector<RankingColumn>& columns, const Json& group,
                 const std::string& best, bool explained) {
  html.open("tbody").open("tr", {{"class", "group"}});
  html.open("th", {{"colspan", std::to_string(columns.size() + 1)}, {"scope", "rowgroup"}});
  const bool station = flag_of(group, "station");
  html.element("bdi", text_of(group, station ? "scene" : "noise_level"));
  std::string rest = (station ? " \u00b7 station" : " \u00b7 " + text_of(group, "scene")) + " \u00b7 protocol " +
                     text_of(group, "protocol") + " \u00b7 " + counted(count_of(group, "instances"), "instance");
  if (group["start"].is_number()) rest += " \u00b7 median error at the start " + number_text(group["start"], 3);
  if (flag_of(group, "measured_only"))
    rest += station ? " \u00b7 measured only: a station has no ground truth"
                    : " \u00b7 measured only: this scene has no ground truth";
  html.element("span", {{"class", "quiet"}}, rest).close().close();
  Block block;
  block.explained = explained;
  for (const Json& row : group["rows"])
    if (has_score(row)) block.scale = std::max(block.scale, score_of(row)["q75"].get<double>());
  const std::vector<std::string> classes = classes_in(group["rows"]);
  const auto ranked = static_cast<std::size_t>(std::count_if(
      classes.begin(), classes.end(), [](const std::string& name) { return name != "oracle" && name != "unknown"; }));
  if (ranked < 2) {
    for (const Json& row : group["rows"]) ranking_row(html, columns, row, text_of(row, "method") == best, block);
    html.close();
    return;
  }
  // A block per class: methods with different observations are not comparable.
  html.close();
  for (const std::string& name : classes) {
    html.open("tbody").open("tr", {{"class", "class"}});
    html.element("th", {{"colspan", std::to_string(columns.size() + 1)}, {"scope", "rowgroup"}}, class_title(name));
    html.close();
    bool first = name != "oracle";
    for (const Json& row : group["rows"])
      if (text_of(row, "class") == name) {
        ranking_row(html, columns, row, first && has_score(row), block);
        first = first && !has_score(row);
      }
    html.close();
  }
}

}  // namespace

std::string ranking_section(const Json& data) {
  if (data["groups"].empty()) return "";
  HtmlWriter html;
  html.element("h2", "Ranking").open("div", {{"class", "scroll"}}).open("table", {{"class", "ranking sortable"}});
  html.open("thead").open("tr");
  const std::vector<RankingColumn> columns = columns_of(data);
  const auto head = [&](const char* kind, const std::string& title, const std::string& unit, const std::string& hint) {
    html.open("th", {{"scope", "col"}, {"class", kind}, {"title", hint}});
    html.element("span", {{"class", "title"}}, title);
    if (!unit.empty()) html.text(" ").element("span", {{"class", "unit"}}, unit);
    html.close();
  };
  head("name", "method", "", "The name given in the suite");
  for (const RankingColumn& column : columns) head(column.kind, column.title, column.unit, column.hint);
  html.close().close();
  std::size_t index = 0, rows = 0;
  for (const Json& group : data["groups"]) rows += group["rows"].size();
  for (const Json& group : data["groups"])
    table_group(html, columns, group, text_of(data["verdict"][index++], "best"), rows <= kMaxRowsExplained);
  html.close().close();
  html.element("p", {{"class", "quiet noprint"}},
               "Click a column title to sort each block. Bold: lowest median of the block, oracles excluded.");
  return html.take();
}

}  // namespace relign::report
