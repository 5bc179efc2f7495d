// Title, verdict and ranking table.
#include <algorithm>

#include "base/text.h"
#include "report/html_writer.h"
#include "report/loaded_results.h"
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
constexpr Column kColumns[] = {
    {"method", "", "The name given in the suite", "name"},
    {"error when glued", "median (quartiles)",
     "Noise-free RMSE against the reference picture at the pose the method recommends after its last step. "
     "Lower is better, 0 is identical.",
     "number"},
    {"", "middle half of the instances",
     "Dot: median. Bar: from the lower to the upper quartile. Same scale within a block, starting at 0.", "range"},
    {"last pose", "median error", "Noise-free RMSE at the pose where the method's last commanded move left the lens",
     "number"},
    {"machine time", "s", "Simulated travel, settling, exposure, readout and the move to the recommended pose; median",
     "number"},
    {"computing", "ms per step", "The algorithm's own time; compare on one machine only; median", "number"},
    {"steps", "", "Moves, each followed by one picture; the picture at the start is step 0", "number"},
    {"failed", "trials", "Trials that ended in an error; left out of the medians", "number"},
    {"knows", "", "What the method is given beyond its moves", "knows"},
};

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

void table_row(HtmlWriter& html, const Json& row, bool best, double scale) {
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
  number_cell(html, finished ? row["commanded"].value("median", Json()) : Json(), 3);
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

void table_group(HtmlWriter& html, const Json& group, const std::string& best) {
  html.open("tbody").open("tr", {{"class", "group"}});
  html.open("th", {{"colspan", std::to_string(std::size(kColumns))}, {"scope", "rowgroup"}});
  html.element("bdi", text_of(group, "noise_level"));
  std::string rest = " \u00b7 " + text_of(group, "scene") + " \u00b7 protocol " + text_of(group, "protocol") +
                     " \u00b7 " + counted(count_of(group, "instances"), "instance");
  if (group["start"].is_number()) rest += " \u00b7 error at the start " + number_text(group["start"], 3) + " (median)";
  if (flag_of(group, "measured_only"))
    rest += flag_of(group, "station") ? " \u00b7 measured only: a station tells no truth"
                                      : " \u00b7 measured only: this scene tells no truth";
  html.element("span", {{"class", "quiet"}}, rest).close().close();

  double scale = 0;
  for (const Json& row : group["rows"])
    if (score_of(row)["n"] != 0) scale = std::max(scale, score_of(row)["q75"].get<double>());
  for (const Json& row : group["rows"]) table_row(html, row, text_of(row, "method") == best, scale);
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
  for (const Json& failure : data["failures"])
    badge(html, "bad", std::to_string(count_of(failure, "count")) + " failed: " + text_of(failure, "method"));
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
  html.element("p", {{"class", "facts"}},
               joined(data["scenes"], ", ") +
                   (data["noise_levels"].size() == 1 ? " \u00b7 noise level " : " \u00b7 noise levels ") +
                   joined(data["noise_levels"], ", ") + " \u00b7 " + counted(count_of(data, "instances"), "instance") +
                   " each \u00b7 protocol " + joined(data["protocols"], " and ") + " \u00b7 " + range + " steps" +
                   (failed + missing == 0 ? "" : " \u00b7 incomplete"));
  html.open("p", {{"class", "intro"}});
  html.text(
      "Which method aligns the lens best? Every method was given the same instances (lenses with their own "
      "manufacturing errors, start and stage) and the same kind of steps: one move, one picture. ");
  html.element("b", "Error");
  const auto measured_only = [](const Json& group) { return flag_of(group, "measured_only"); };
  const Json& groups = data["groups"];
  if (!std::all_of(groups.begin(), groups.end(), measured_only))
    html.text(
        " is how far the picture would be from the reference if the lens were glued where the method then recommends: "
        "RMSE, without camera noise; 0 is identical, lower is better.");
  if (std::any_of(groups.begin(), groups.end(), measured_only))
    html.text(
        " marked \u201cmeasured only\u201d is the lowest RMSE between a picture and the reference that the method saw, "
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
  for (const Column& column : kColumns) {
    html.open("th", {{"scope", "col"}, {"class", column.kind}, {"title", column.hint}});
    html.element("span", {{"class", "title"}}, column.title);
    if (*column.unit) html.text(" ").element("span", {{"class", "unit"}}, column.unit);
    html.close();
  }
  html.close().close();
  std::size_t index = 0;
  for (const Json& group : data["groups"]) table_group(html, group, text_of(data["verdict"][index++], "best"));
  html.close().close();
  html.element(
      "p", {{"class", "quiet noprint"}},
      "A click on a column's title sorts each block. Bold: lowest median among the methods that are no oracle.");
  return html.take();
}

}  // namespace relign::report
