// Title, verdict and ranking table.
#include <algorithm>
#include <map>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "report/html_writer.h"
#include "report/page_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

struct Column {
  const char* title;
  const char* unit;
  const char* hint;
  const char* kind;  // class of its cells
};

// Where no scene tells a truth, no column speaks of one.
std::vector<Column> columns_of(const Json& data) {
  const bool truth = !every_group(data, "measured_only");
  std::vector<Column> columns = {{"method", "", "The name given in the suite", "name"}};
  if (truth)
    columns.push_back({"error when glued", "median (quartiles)",
                       "Noise-free RMSE against the reference picture at the pose the method recommends after its last "
                       "step. Lower is better, 0 is identical.",
                       "number"});
  else
    columns.push_back({"lowest measured error", "median (quartiles)",
                       "Lowest RMSE between a picture that the method saw and the reference picture, camera noise "
                       "included. Lower is better.",
                       "number"});
  columns.push_back(
      {"", "middle half of the instances",
       "Dot: median. Bar: from the lower to the upper quartile. Same scale within a block, starting at 0.", "range"});
  if (truth)
    columns.push_back({"last pose", "median error",
                       "Noise-free RMSE at the pose where the method's last commanded move left the lens", "number"});
  columns.push_back({"machine time", "s",
                     every_group(data, "station") ? "Of all moves and pictures, as the station tells it; median"
                                                  : "Simulated travel, settling, exposure, readout and the move to the "
                                                    "recommended pose; median",
                     "number"});
  columns.push_back(
      {"computing", "ms per step", "The algorithm's own time; compare on one machine only; median", "number"});
  columns.push_back({"steps", "", "Moves, each followed by one picture; the picture at the start is step 0", "number"});
  columns.push_back({"failed", "trials", "Trials that ended in an error; left out of the medians", "number"});
  columns.push_back({"knows", "", "What the method is given beyond its moves", "knows"});
  return columns;
}

std::string sort_value(const Json& number) { return number.is_number() ? shortest(number.get<double>()) : ""; }

void number_cell(HtmlWriter& html, const Json& number, int digits) {
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(number)}}, number_text(number, digits));
}

// A bar from the lower to the upper quartile with a dot at the median.
void range_cell(HtmlWriter& html, const Json& error, double scale) {
  constexpr double kWidth = 150;
  html.open("td", {{"class", "range"}, {"data-sort", error["n"] == 0 ? "" : sort_value(error["median"])}});
  if (error["n"] != 0 && scale > 0) {
    const auto x = [&](const char* key) {
      return significant(5 + (kWidth - 10) * error[key].get<double>() / scale, 4);
    };
    html.open("svg", {{"viewBox", "0 0 150 14"}, {"width", "150"}, {"height", "14"}, {"aria-hidden", "true"}});
    html.empty("line", {{"x1", "5"}, {"x2", "145"}, {"y1", "7"}, {"y2", "7"}, {"class", "scale"}});
    html.empty("line", {{"x1", x("q25")}, {"x2", x("q75")}, {"y1", "7"}, {"y2", "7"}, {"class", "bar"}});
    html.empty("circle", {{"cx", x("median")}, {"cy", "7"}, {"r", "4"}});
    html.close();
  }
  html.close();
}

void table_row(HtmlWriter& html, const Json& row, bool best, double scale, bool truth_known) {
  const Json& error = score_of(row);
  const bool finished = error["n"] != 0;
  html.open("tr", {{"class", best ? "best" : flag_of(row, "oracle") ? "oracle" : "plain"}});
  html.open("th", {{"scope", "row"}, {"class", "name"}, {"data-sort", text_of(row, "method")}});
  html.element("bdi", text_of(row, "method"));
  if (flag_of(row, "oracle")) html.text(" ").element("span", {{"class", "tag"}}, "oracle");
  html.close();

  html.open("td", {{"class", "number error"}, {"data-sort", finished ? sort_value(error["median"]) : ""}});
  html.element("b", finished ? number_text(error["median"], 3) : "-");
  if (finished && error["n"] != 1)
    html.text(" ").element("span", {{"class", "quartiles"}},
                           "(" + number_text(error["q25"], 3) + "\u2013" + number_text(error["q75"], 3) + ")");
  html.close();
  range_cell(html, error, scale);
  if (truth_known) number_cell(html, finished ? row["commanded"].value("median", Json()) : Json(), 3);
  number_cell(html, row["machine_seconds"], 3);
  number_cell(html, row["algorithm_ms_per_step"], 2);
  number_cell(html, finished ? row["step"] : Json(), 6);
  html.element("td",
               {{"class", count_of(row, "failed") > 0 ? "number bad" : "number"},
                {"data-sort", std::to_string(count_of(row, "failed"))}},
               std::to_string(count_of(row, "failed")));
  html.element("td", {{"class", "knows"}, {"data-sort", joined(row["knows"], ", ")}}, joined(row["knows"], ", "));
  html.close();
}

void table_group(HtmlWriter& html, const Json& group, const std::string& best, std::size_t columns, bool truth_known) {
  html.open("tbody").open("tr", {{"class", "group"}});
  html.open("th", {{"colspan", std::to_string(columns)}, {"scope", "rowgroup"}});
  const bool station = flag_of(group, "station");
  html.element("bdi", text_of(group, station ? "scene" : "noise_level"));
  std::string rest = (station ? " \u00b7 station" : " \u00b7 " + text_of(group, "scene")) + " \u00b7 protocol " +
                     text_of(group, "protocol") + " \u00b7 " + counted(count_of(group, "instances"), "instance");
  if (group["start"].is_number()) rest += " \u00b7 error at the start " + number_text(group["start"], 3) + " (median)";
  if (flag_of(group, "measured_only"))
    rest += station ? " \u00b7 measured only: a station tells no truth"
                    : " \u00b7 measured only: this scene tells no truth";
  html.element("span", {{"class", "quiet"}}, rest).close().close();

  double scale = 0;
  for (const Json& row : group["rows"])
    if (score_of(row)["n"] != 0) scale = std::max(scale, score_of(row)["q75"].get<double>());
  for (const Json& row : group["rows"]) table_row(html, row, text_of(row, "method") == best, scale, truth_known);
  html.close();
}

void badge(HtmlWriter& html, const char* kind, const std::string& text) {
  html.element("span", {{"class", std::string("badge ") + kind}}, text).text(" ");
}

}  // namespace

std::string number_text(const Json& number, int digits) {
  if (number.is_number_unsigned()) return std::to_string(number.get<std::uint64_t>());
  return number.is_number() ? significant(number.get<double>(), digits) : "-";
}

std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string joined(const Json& list, const std::string& separator) {
  std::string out;
  for (const Json& item : list)
    out += (out.empty() ? "" : separator) + (item.is_string() ? item.get<std::string>() : item.dump());
  return out;
}

bool any_group(const Json& data, const char* flag) {
  const Json& groups = data["groups"];
  return std::any_of(groups.begin(), groups.end(), [flag](const Json& group) { return flag_of(group, flag); });
}

bool every_group(const Json& data, const char* flag) {
  const Json& groups = data["groups"];
  return std::all_of(groups.begin(), groups.end(), [flag](const Json& group) { return flag_of(group, flag); });
}

std::string title_section(const Json& data) {
  HtmlWriter html;
  const Json& ran = data["ran"];
  const std::uint64_t planned = count_of(ran, "planned"), finished = count_of(ran, "finished"),
                      failed = count_of(ran, "failed"), missing = count_of(ran, "missing");
  const std::string name = text_of(data, "suite_name");
  html.open("h1").element("bdi", name.empty() ? "Results without a name" : name).close();
  html.open("p", {{"class", "badges"}});
  badge(html, finished == planned && planned > 0 ? "good" : "bad",
        planned == 0 ? "no trials" : std::to_string(finished) + "/" + std::to_string(planned) + " trials ran");
  std::map<std::string, std::uint64_t> failures;  // whatever their messages
  for (const Json& failure : data["failures"]) failures[text_of(failure, "method")] += count_of(failure, "count");
  for (const auto& [method, count] : failures) badge(html, "bad", std::to_string(count) + " failed: " + method);
  if (missing > 0) badge(html, "bad", counted(missing, "trial") + " not finished");
  html.close();
  if (data["groups"].empty()) {
    html.element("p", {{"class", "facts"}},
                 planned > 0 ? "No trial of this run has finished yet, so there is nothing to compare."
                             : "This results folder holds no trials, so there is nothing to compare.");
    return html.take();
  }
  const Json& steps = data["steps"];
  const std::string range = steps[0] == steps[1] ? steps[1].dump() : steps[0].dump() + " to " + steps[1].dump();
  const std::string levels = (data["noise_levels"].size() == 1 ? " \u00b7 noise level " : " \u00b7 noise levels ") +
                             joined(data["noise_levels"], ", ");
  html.element("p", {{"class", "facts"}},
               joined(data["scenes"], ", ") + (every_group(data, "station") ? "" : levels) + " \u00b7 " +
                   counted(count_of(data, "instances"), "instance") + " each \u00b7 protocol " +
                   joined(data["protocols"], " and ") + " \u00b7 " + range + " steps" +
                   (failed + missing == 0 ? "" : " \u00b7 incomplete"));
  html.open("p", {{"class", "intro"}});
  html.text("Which method aligns the lens best? ");
  if (!every_group(data, "station"))
    html.text(
        "Every method was given the same instances (lenses with their own manufacturing errors, start and stage) and "
        "the same kind of steps: one move, one picture. ");
  if (any_group(data, "station"))
    html.text(
        "On a station lenses, start and stage are real. Every method asked it for the same lenses, one move and one "
        "picture a step; whether they were the same, the station alone can tell. ");
  html.element("b", "Error");
  if (!every_group(data, "measured_only"))
    html.text(
        " is how far the picture would be from the reference if the lens were glued where the method then recommends: "
        "RMSE, without camera noise; 0 is identical, lower is better.");
  if (any_group(data, "measured_only"))
    html.text(std::string(every_group(data, "measured_only") ? "" : " marked \u201cmeasured only\u201d") +
              " is the lowest RMSE between a picture and the reference that the method saw, "
              "camera noise included: what a station can tell. Nobody knows its truth.");
  html.close();
  return html.take();
}

std::string verdict_section(const Json& data) {
  HtmlWriter html;
  if (!data["verdict"].empty()) {
    html.element("h2", "Verdict").open("ul", {{"class", "verdict"}});
    for (const Json& entry : data["verdict"]) {
      html.open("li").element("b", {{"class", "label"}}, text_of(entry, "label")).text(": ");
      // The winner's name opens the sentence.
      const std::string best = text_of(entry, "best"), text = text_of(entry, "text");
      if (!best.empty()) html.element("b", best);
      html.text(text.substr(best.size())).close();
    }
    html.close();
  }
  if (!data["beware"].empty()) {
    html.open("ul", {{"class", "beware"}});
    for (const Json& text : data["beware"]) html.element("li", text.get<std::string>());
    html.close();
  }
  return html.take();
}

std::string ranking_section(const Json& data) {
  if (data["groups"].empty()) return "";
  HtmlWriter html;
  html.element("h2", "Ranking").open("div", {{"class", "scroll"}}).open("table", {{"class", "ranking"}});
  html.open("thead").open("tr");
  const std::vector<Column> columns = columns_of(data);
  for (const Column& column : columns) {
    html.open("th", {{"scope", "col"}, {"class", column.kind}, {"title", column.hint}});
    html.element("span", {{"class", "title"}}, column.title);
    if (*column.unit) html.text(" ").element("span", {{"class", "unit"}}, column.unit);
    html.close();
  }
  html.close().close();
  std::size_t index = 0;
  for (const Json& group : data["groups"])
    table_group(html, group, text_of(data["verdict"][index++], "best"), columns.size(),
                !every_group(data, "measured_only"));
  html.close().close();
  html.element(
      "p", {{"class", "quiet noprint"}},
      "A click on a column's title sorts each block. Bold: lowest median among the methods that are no oracle.");
  return html.take();
}

}  // namespace relign::report
