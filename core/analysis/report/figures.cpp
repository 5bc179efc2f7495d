#include "report/figures.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/files.h"
#include "base/json_members.h"
#include "report/page_data.h"
#include "statistics/band.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

constexpr double kMinSteps = 0.8;  // start of a logarithmic axis of images

const Json* entry_of(const Json& list, const std::string& method) {
  for (const Json& entry : list)
    if (text_of(entry, "method") == method) return &entry;
  return nullptr;
}

int style_of(const std::map<std::string, int>& styles, const std::string& method, const Json& group) {
  const auto found = styles.find(style_key(method, text_of(group, "protocol")));
  return found == styles.end() ? kOracleStyle : found->second;
}

// Room for one label per series.
double height_for(std::size_t series) { return std::max(300.0, 90 + 12.0 * static_cast<double>(series)); }

std::string group_file(const Json& group, std::size_t index) {
  return std::to_string(index + 1) + "-" + figure_file_name(text_of(group, "label"));
}

// A group's methods, best first.
std::vector<const Json*> shown_rows(const Json& group, std::size_t most) {
  std::vector<const Json*> rows;
  for (const Json& row : group["rows"])
    if (rows.size() < most) rows.push_back(&row);
  return rows;
}

ChartSeries curve_series(const Json& curve, const std::string& track, int style, bool& has_intervals) {
  ChartSeries series = {text_of(curve, "method"), style, Drawn::line, {}};
  const Json& values = object_of(object_of(curve, "tracks"), track.c_str());
  const Json &median = list_of(values, "median"), &low = list_of(values, "lo95"), &high = list_of(values, "hi95");
  for (std::size_t i = 0; i < median.size(); ++i) {
    const bool interval = std::isfinite(number_in(low, i)) && std::isfinite(number_in(high, i));
    has_intervals = has_intervals || interval;
    series.points.push_back({static_cast<double>(count_of(curve, "first_step") + i), number_in(median, i),
                             interval ? number_in(low, i) : statistics::kMissing,
                             interval ? number_in(high, i) : statistics::kMissing});
  }
  return series;
}

void add_quartiles(ChartSeries& series, const Json& values) {
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    series.points[i].low = number_in(list_of(values, "q25"), i);
    series.points[i].high = number_in(list_of(values, "q75"), i);
  }
}

}  // namespace

std::string figure_file_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool kept =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_';
    if (kept)
      name += c;
    else if (!name.empty() && name.back() != '-')
      name += '-';
    if (name.size() >= 60) break;
  }
  while (!name.empty() && (name.back() == '-' || name.back() == '.')) name.pop_back();
  return name.empty() ? "unnamed" : name;
}

std::map<std::string, int> method_styles(const Json& data) {
  std::set<std::string> used;
  for (const Json& group : data["groups"])
    for (const Json& curve : group["curves"])
      used.insert(style_key(text_of(curve, "method"), text_of(group, "protocol")));
  std::map<std::string, int> styles;
  std::map<std::string, int> of_name;  // the same under every protocol
  for (const Json& method : data["methods"]) {
    const std::string name = text_of(method, "name"), key = style_key(name, text_of(method, "protocol"));
    if (used.count(key) == 0) continue;
    styles[key] = flag_of(method, "oracle") ? kOracleStyle
                                            : of_name.try_emplace(name, static_cast<int>(of_name.size())).first->second;
  }
  return styles;
}

std::vector<Figure> curve_figures(const Json& data, std::size_t index) {
  const Json& group = data["groups"][index];
  const std::map<std::string, int> styles = method_styles(data);
  const statistics::Rule rule = statistics::rule_named(text_of(data, "rule")).value_or(statistics::Rule::own);
  const std::string track =
      flag_of(group, "measured_only") ? "best" : statistics::track_name(statistics::track_of(rule));
  Chart chart;
  bool has_intervals = false;
  for (const Json* row : shown_rows(group, kMaxMethodsInFigure)) {
    const std::string method = text_of(*row, "method");
    const Json* curve = entry_of(group["curves"], method);
    if (!curve || object_of(object_of(*curve, "tracks"), track.c_str()).empty()) continue;
    chart.series.push_back(curve_series(*curve, track, style_of(styles, method, group), has_intervals));
  }
  if (chart.series.empty()) return {};
  if (!has_intervals)
    for (ChartSeries& series : chart.series)
      add_quartiles(series, (*entry_of(group["curves"], series.name))["tracks"][track]);
  chart.title = text_of(group, "label");
  chart.x = {"images", false, true, {}};
  chart.y = {
      track == "best" ? "lowest measured error (RMSE)" : "error at the recommended pose (RMSE)", true, false, {}};
  chart.height = height_for(chart.series.size());
  if (track != "best") {
    const Json& floor = object_of(group, "floor");
    chart.levels = {{"own optimum", number_in(floor, "own_optimum"), false},
                    {"bound of one more image", number_in(floor, "next_image"), true},
                    {"spec", number_in(group, "spec_rmse"), false}};
  }
  return {{"curves-" + group_file(group, index),
           std::string("Error after each image: median over instances; bands are ") +
               (has_intervals ? "95 % confidence intervals of the median." : "quartiles."),
           chart}};
}

std::vector<Figure> ecdf_figures(const Json& data, std::size_t index, std::size_t most) {
  const Json& group = data["groups"][index];
  const std::map<std::string, int> styles = method_styles(data);
  Chart chart;
  double last = 1;
  for (const Json& entry : list_of(group, "ecdf"))
    if (const Json& steps = list_of(entry, "steps"); !steps.empty())
      last = std::max(last, number_in(steps, steps.size() - 1));
  for (const Json* row : shown_rows(group, most)) {
    const std::string method = text_of(*row, "method");
    const Json* entry = entry_of(list_of(group, "ecdf"), method);
    if (!entry) continue;
    ChartSeries series = {method, style_of(styles, method, group), Drawn::steps, {}};
    const Json &steps = list_of(*entry, "steps"), &share = list_of(*entry, "share");
    for (std::size_t i = 0; i < std::min(steps.size(), share.size()); ++i)
      series.points.push_back({number_in(steps, i), 100 * number_in(share, i)});
    if (series.points.empty()) continue;
    if (series.points.back().x < last) series.points.push_back({last, series.points.back().y});
    chart.series.push_back(std::move(series));
  }
  if (chart.series.empty()) return {};
  // Labels in order of the final value.
  std::stable_sort(chart.series.begin(), chart.series.end(),
                   [](const ChartSeries& a, const ChartSeries& b) { return a.points.back().y > b.points.back().y; });
  chart.title = text_of(group, "label");
  chart.x = {"images", true, true, {}, kMinSteps, last};
  chart.y = {"targets reached, %", false, false, {}, 0, 100};
  chart.height = height_for(chart.series.size());
  return {{"targets-" + group_file(group, index),
           "Runtime ECDF: share of (instance, error target) pairs reached within a number of images.", chart}};
}

std::vector<Figure> residual_figures(const Json& data, std::size_t index, std::size_t most) {
  const Json& group = data["groups"][index];
  const std::map<std::string, int> styles = method_styles(data);
  std::vector<Figure> figures;
  std::map<std::string, std::size_t> by_unit;
  for (const Json* row : shown_rows(group, most)) {
    const std::string method = text_of(*row, "method");
    for (const Json& axis : list_of(object_of(*row, "residual"), "axes")) {
      const std::string unit = text_of(axis, "unit"), name = text_of(axis, "name");
      const auto [found, is_new] = by_unit.try_emplace(unit, figures.size());
      if (is_new) {
        Chart chart;
        chart.title = text_of(group, "label");
        chart.x.title = "axis";
        chart.y = {"residual misalignment" + (unit.empty() ? "" : ", " + unit), true, false, {}};
        figures.push_back(
            {"misalignment-" + figure_file_name(unit) + "-" + group_file(group, index),
             "Absolute distance of the recommended pose from the instance's own optimum: median (dot) and "
             "upper quartile (end of the line).",
             chart});
      }
      Chart& chart = figures[found->second].chart;
      std::vector<std::string>& axes = chart.x.categories;
      const auto place = std::find(axes.begin(), axes.end(), name);
      const auto at = static_cast<double>(place - axes.begin());
      if (place == axes.end()) axes.push_back(name);
      if (chart.series.empty() || chart.series.back().name != method)
        chart.series.push_back({method, style_of(styles, method, group), Drawn::marks, {}});
      const double median = number_in(axis, "median");
      chart.series.back().points.push_back({at, median, median, number_in(axis, "q75")});
    }
  }
  for (Figure& figure : figures) figure.chart.height = height_for(figure.chart.series.size());
  return figures;
}

std::vector<Figure> level_figures(const Json& data) {
  const std::map<std::string, int> styles = method_styles(data);
  std::vector<Figure> figures;
  std::set<std::pair<std::string, std::string>> done;
  for (const Json& first : data["groups"]) {
    const std::string scene = text_of(first, "scene"), protocol = text_of(first, "protocol");
    if (!done.emplace(scene, protocol).second) continue;
    std::vector<const Json*> groups;  // in the order of the levels
    for (const Json& group : data["groups"])
      if (text_of(group, "scene") == scene && text_of(group, "protocol") == protocol) groups.push_back(&group);
    Chart yield, images;
    for (const Json* row : shown_rows(first, kMaxMethodsInFigure)) {
      const std::string method = text_of(*row, "method");
      ChartSeries in_spec = {method, style_of(styles, method, first), Drawn::marked_line, {}}, to_spec = in_spec;
      for (std::size_t k = 0; k < groups.size(); ++k) {
        const Json* here = entry_of((*groups[k])["rows"], method);
        if (!here) continue;
        const Json &share = object_of(*here, "yield"), &steps = object_of(*here, "to_spec");
        const auto x = static_cast<double>(k);
        in_spec.points.push_back(
            {x, 100 * number_in(share, "share"), 100 * number_in(share, "lo95"), 100 * number_in(share, "hi95")});
        to_spec.points.push_back({x, number_in(steps, "steps"), number_in(steps, "lo95"), number_in(steps, "hi95")});
      }
      const auto any = [](const ChartSeries& series) {
        return std::any_of(series.points.begin(), series.points.end(),
                           [](const ChartPoint& point) { return std::isfinite(point.y); });
      };
      if (any(in_spec)) yield.series.push_back(std::move(in_spec));
      if (any(to_spec)) images.series.push_back(std::move(to_spec));
    }
    for (Chart* chart : {&yield, &images}) {
      chart->title = scene + ", " + protocol;
      chart->x.title = "noise level";
      for (const Json* group : groups) chart->x.categories.push_back(text_of(*group, "noise_level"));
      chart->height = height_for(chart->series.size());
    }
    yield.y = {"instances in spec, %", false, false, {}, 0, 100};
    images.y = {"images to spec", true, true, {}};
    const std::string file = std::to_string(done.size()) + "-" + figure_file_name(scene + "-" + protocol);
    if (!yield.series.empty())
      figures.push_back({"yield-" + file,
                         "Yield: instances in specification after the last image; bars are 95 % Wilson intervals.",
                         yield});
    if (!images.series.empty())
      figures.push_back(
          {"images-to-spec-" + file,
           "Images to specification: Kaplan-Meier median with its 95 % interval; no mark if fewer than half "
           "of the instances reach it.",
           images});
  }
  return figures;
}

std::vector<Figure> all_figures(const Json& data) {
  std::vector<Figure> figures;
  const auto add = [&](std::vector<Figure> more) { std::move(more.begin(), more.end(), std::back_inserter(figures)); };
  for (std::size_t i = 0; i < list_of(data, "aggregate").size(); ++i) add(aggregate_figures(data, i));
  for (std::size_t i = 0; i < data["groups"].size(); ++i) {
    add(curve_figures(data, i));
    add(ecdf_figures(data, i));
    add(residual_figures(data, i));
  }
  add(level_figures(data));
  const Json& scenes = list_of(data, "scene_facts");
  for (std::size_t i = 0; i < scenes.size(); ++i)
    if (std::optional<Figure> figure = landscape_figure(scenes[i], i)) figures.push_back(std::move(*figure));
  return figures;
}

std::vector<std::filesystem::path> write_figures(const Json& data, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::filesystem::create_directories(folder);
  for (const Figure& figure : all_figures(data)) {
    files.push_back(folder / (figure.name + ".svg"));
    write_file_atomically(files.back(), chart_svg(figure.chart));
    files.push_back(folder / (figure.name + ".csv"));
    write_file_atomically(files.back(), chart_csv(figure.chart));
  }
  return files;
}

}  // namespace relign::report
