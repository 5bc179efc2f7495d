#include "report/figures.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "base/files.h"
#include "statistics/band.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

constexpr double kMinSteps = 0.8;  // start of a logarithmic axis of images

// nullptr if the list has no entry of the method.
template <class Entry>
const Entry* entry_of(const std::vector<Entry>& list, const std::string& method) {
  for (const Entry& entry : list)
    if (entry.method == method) return &entry;
  return nullptr;
}

int style_of(const std::map<std::string, int>& styles, const std::string& method, const Group& group) {
  const auto found = styles.find(style_key(method, group.protocol));
  return found == styles.end() ? kOracleStyle : found->second;
}

// Room for one label per series.
double height_for(std::size_t series) { return std::max(300.0, 90 + 12.0 * static_cast<double>(series)); }

std::string group_file(const Group& group, std::size_t index) {
  return std::to_string(index + 1) + "-" + figure_file_name(group.label);
}

// A group's methods, best first.
std::span<const Row> shown_rows(const Group& group, std::size_t most) {
  return std::span(group.rows).first(std::min(most, group.rows.size()));
}

ChartSeries curve_series(const Curve& curve, const CurveTrack& track, int style, bool& has_intervals) {
  ChartSeries series = {curve.method, style, Drawn::line, {}};
  for (std::size_t i = 0; i < track.median.size(); ++i) {
    const statistics::Interval interval =
        track.low.empty() ? statistics::Interval() : statistics::Interval{track.low[i], track.high[i]};
    has_intervals = has_intervals || interval.exists();
    series.points.push_back({static_cast<double>(curve.first_step + i), track.median[i], interval.low, interval.high});
  }
  return series;
}

void add_quartiles(ChartSeries& series, const CurveTrack& track) {
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    series.points[i].low = track.q25[i];
    series.points[i].high = track.q75[i];
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

std::map<std::string, int> method_styles(const PageModel& page) {
  std::set<std::string> used;
  for (const Group& group : page.groups)
    for (const Curve& curve : group.curves) used.insert(style_key(curve.method, group.protocol));
  std::map<std::string, int> styles;
  std::map<std::string, int> of_name;  // the same under every protocol
  for (const Method& method : page.methods) {
    const std::string key = style_key(method.name, method.protocol);
    if (used.count(key) == 0) continue;
    styles[key] = method.of_class == ObservationClass::oracle
                      ? kOracleStyle
                      : of_name.try_emplace(method.name, static_cast<int>(of_name.size())).first->second;
  }
  return styles;
}

std::vector<Figure> curve_figures(const PageModel& page, std::size_t index) {
  const Group& group = page.groups[index];
  const std::map<std::string, int> styles = method_styles(page);
  const statistics::Track track = group.measured_only ? statistics::Track::best : statistics::track_of(page.rule);
  Chart chart;
  bool has_intervals = false;
  for (const Row& row : shown_rows(group, kMaxMethodsInFigure)) {
    const Curve* curve = entry_of(group.curves, row.method);
    if (!curve || curve->track(track).median.empty()) continue;
    chart.series.push_back(
        curve_series(*curve, curve->track(track), style_of(styles, row.method, group), has_intervals));
  }
  if (chart.series.empty()) return {};
  if (!has_intervals)
    for (ChartSeries& series : chart.series) add_quartiles(series, entry_of(group.curves, series.name)->track(track));
  chart.title = group.label;
  chart.x = {group.words.counts(), false, true, {}};
  chart.y = {(group.measured_only ? "lowest measured error (" : "error at the recommended pose (") +
                 group.scored_by.label() + ")",
             group.scored_by.logarithmic,
             false,
             {}};
  chart.height = height_for(chart.series.size());
  if (!group.measured_only)
    chart.levels = {{"optimum", group.own_optimum, false},
                    {"bound of one more image", group.next_image, true},
                    {"spec", group.spec.score, false}};
  return {{"curves-" + group_file(group, index),
           "Error after each " + group.words.counted + ": median over instances; bands are " +
               (has_intervals ? "95 % confidence intervals of the median." : "quartiles."),
           chart}};
}

std::vector<Figure> ecdf_figures(const PageModel& page, std::size_t index, std::size_t most) {
  const Group& group = page.groups[index];
  const std::map<std::string, int> styles = method_styles(page);
  Chart chart;
  double last = 1;
  for (const Ecdf& ecdf : group.ecdf)
    if (!ecdf.points.empty()) last = std::max(last, static_cast<double>(ecdf.points.back().first));
  for (const Row& row : shown_rows(group, most)) {
    const Ecdf* ecdf = entry_of(group.ecdf, row.method);
    if (!ecdf || ecdf->points.empty()) continue;
    ChartSeries series = {row.method, style_of(styles, row.method, group), Drawn::steps, {}};
    for (const auto& [step, share] : ecdf->points) series.points.push_back({static_cast<double>(step), 100 * share});
    if (series.points.back().x < last) series.points.push_back({last, series.points.back().y});
    chart.series.push_back(std::move(series));
  }
  if (chart.series.empty()) return {};
  // Labels in order of the final value.
  std::stable_sort(chart.series.begin(), chart.series.end(),
                   [](const ChartSeries& a, const ChartSeries& b) { return a.points.back().y > b.points.back().y; });
  chart.title = group.label;
  chart.x = {group.words.counts(), true, true, {}, kMinSteps, last};
  chart.y = {"targets reached, %", false, false, {}, 0, 100};
  chart.height = height_for(chart.series.size());
  return {{"targets-" + group_file(group, index),
           "Runtime ECDF: share of (instance, error target) pairs reached within a number of " + group.words.counts() +
               " after the " + (group.words.counted == "move" ? "start." : "one at the start."),
           chart}};
}

std::vector<Figure> residual_figures(const PageModel& page, std::size_t index, std::size_t most) {
  const Group& group = page.groups[index];
  const std::map<std::string, int> styles = method_styles(page);
  std::vector<Figure> figures;
  std::map<std::string, std::size_t> by_unit;
  for (const Row& row : shown_rows(group, most)) {
    for (const ResidualAxis& axis : row.residual) {
      const auto [found, is_new] = by_unit.try_emplace(axis.unit, figures.size());
      if (is_new) {
        Chart chart;
        chart.title = group.label;
        chart.x.title = "axis";
        chart.y = {"residual misalignment" + (axis.unit.empty() ? "" : ", " + axis.unit), true, false, {}};
        figures.push_back({"misalignment-" + figure_file_name(axis.unit) + "-" + group_file(group, index),
                           "Absolute distance of the recommended pose from the instance's optimum: median (dot) and "
                           "upper quartile (end of the line).",
                           chart});
      }
      Chart& chart = figures[found->second].chart;
      std::vector<std::string>& axes = chart.x.categories;
      const auto place = std::find(axes.begin(), axes.end(), axis.name);
      const auto at = static_cast<double>(place - axes.begin());
      if (place == axes.end()) axes.push_back(axis.name);
      if (chart.series.empty() || chart.series.back().name != row.method)
        chart.series.push_back({row.method, style_of(styles, row.method, group), Drawn::marks, {}});
      chart.series.back().points.push_back({at, axis.median, axis.median, axis.q75});
    }
  }
  for (Figure& figure : figures) figure.chart.height = height_for(figure.chart.series.size());
  return figures;
}

std::vector<Figure> level_figures(const PageModel& page) {
  const std::map<std::string, int> styles = method_styles(page);
  std::vector<Figure> figures;
  std::set<std::pair<std::string, std::string>> done;
  const auto finite = [](double value) { return std::isfinite(value) ? value : kMissing; };
  for (const Group& first : page.groups) {
    if (!done.emplace(first.scene, first.protocol).second) continue;
    std::vector<const Group*> groups;  // in the order of the levels
    for (const Group& group : page.groups)
      if (group.scene == first.scene && group.protocol == first.protocol) groups.push_back(&group);
    Chart yield, moves;
    for (const Row& row : shown_rows(first, kMaxMethodsInFigure)) {
      ChartSeries in_spec = {row.method, style_of(styles, row.method, first), Drawn::marked_line, {}};
      ChartSeries to_spec = in_spec;
      for (std::size_t k = 0; k < groups.size(); ++k) {
        const Row* here = entry_of(groups[k]->rows, row.method);
        if (!here) continue;
        const Share share = here->yield.value_or(Yield());
        const TimeToSpec time = here->to_spec.value_or(TimeToSpec());
        const auto x = static_cast<double>(k);
        in_spec.points.push_back({x, 100 * share.share, 100 * share.interval.low, 100 * share.interval.high});
        to_spec.points.push_back({x, finite(time.steps), finite(time.interval.low), finite(time.interval.high)});
      }
      const auto any = [](const ChartSeries& series) {
        return std::any_of(series.points.begin(), series.points.end(),
                           [](const ChartPoint& point) { return std::isfinite(point.y); });
      };
      if (any(in_spec)) yield.series.push_back(std::move(in_spec));
      if (any(to_spec)) moves.series.push_back(std::move(to_spec));
    }
    for (Chart* chart : {&yield, &moves}) {
      chart->title = first.scene + ", " + first.protocol;
      chart->x.title = "noise level";
      for (const Group* group : groups) chart->x.categories.push_back(group->noise_level);
      chart->height = height_for(chart->series.size());
    }
    yield.y = {"instances in spec, %", false, false, {}, 0, 100};
    moves.y = {"moves to spec", true, true, {}};
    const std::string file = std::to_string(done.size()) + "-" + figure_file_name(first.scene + "-" + first.protocol);
    if (!yield.series.empty())
      figures.push_back({"yield-" + file,
                         "Yield: instances in specification after the last " + first.words.counted +
                             "; bars are 95 % Wilson intervals.",
                         yield});
    if (!moves.series.empty())
      figures.push_back(
          {"images-to-spec-" + file,
           "Moves to specification, each with " + first.words.a_capture() +
               ": Kaplan-Meier median with its 95 % interval; no mark if fewer than half of the instances reach it.",
           moves});
  }
  return figures;
}

std::vector<Figure> all_figures(const PageModel& page) {
  std::vector<Figure> figures;
  const auto add = [&](std::vector<Figure> more) { std::move(more.begin(), more.end(), std::back_inserter(figures)); };
  for (std::size_t i = 0; i < page.aggregates.size(); ++i) add(aggregate_figures(page, i));
  for (std::size_t i = 0; i < page.groups.size(); ++i) {
    add(curve_figures(page, i));
    add(ecdf_figures(page, i));
    add(residual_figures(page, i));
  }
  add(level_figures(page));
  for (std::size_t i = 0; i < page.scene_facts.size(); ++i)
    if (std::optional<Figure> figure = landscape_figure(page.scene_facts[i], i)) figures.push_back(std::move(*figure));
  return figures;
}

std::vector<std::filesystem::path> write_figures(const PageModel& page, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::filesystem::create_directories(folder);
  for (const Figure& figure : all_figures(page)) {
    files.push_back(folder / (figure.name + ".svg"));
    write_file_atomically(files.back(), chart_svg(figure.chart));
    files.push_back(folder / (figure.name + ".csv"));
    write_file_atomically(files.back(), chart_csv(figure.chart));
  }
  return files;
}

namespace {

// A method with several trainings has the style of the first, which has a curve of its own in other charts.
int aggregate_style(const PageModel& page, const std::map<std::string, int>& styles, const AggregateMethod& method,
                    const std::string& protocol) {
  if (method.oracle()) return kOracleStyle;
  auto found = styles.find(style_key(method.method, protocol));
  if (found == styles.end() && !method.trainings.empty())
    found = styles.find(style_key(method.method + " (" + method.trainings.front().name + ")", protocol));
  return found == styles.end() ? static_cast<int>(page.methods.size()) : found->second;
}

}  // namespace

std::vector<Figure> aggregate_figures(const PageModel& page, std::size_t index, std::size_t most) {
  const Aggregate& aggregate = page.aggregates[index];
  const std::map<std::string, int> styles = method_styles(page);
  const std::vector<double> places = shown(statistics::profile_places());
  Chart profile, progress;
  for (const AggregateMethod& method : aggregate.methods) {
    if (profile.series.size() >= most || !method.has_numbers()) continue;
    const int style = aggregate_style(page, styles, method, aggregate.protocol);
    ChartSeries spread = {method.method, style, Drawn::line, {}}, falling = {method.method, style, Drawn::steps, {}};
    for (std::size_t i = 0; i < places.size() && i < method.bands.profile.size(); ++i) {
      const statistics::Band& share = method.bands.profile[i];
      spread.points.push_back({places[i], 100 * share.estimate, 100 * share.interval.low, 100 * share.interval.high});
    }
    for (std::size_t step = 1; step < method.by_step.size(); ++step)
      falling.points.push_back({static_cast<double>(step), method.by_step[step]});
    profile.series.push_back(std::move(spread));
    progress.series.push_back(std::move(falling));
  }
  if (profile.series.empty()) return {};
  profile.title = progress.title = "all scenes and noise levels, " + aggregate.protocol;
  profile.x = {"normalised error", false, false, {}, 0, 1};
  profile.y = {"instances at or below, %", false, false, {}, 0, 100};
  const std::string counts = common_words(page).counts();
  progress.x = {counts, true, true, {}};
  progress.y = {"mean normalised error", false, false, {}, 0, 1};
  profile.height = progress.height = std::max(300.0, 90 + 12.0 * static_cast<double>(profile.series.size()));
  const std::string file = std::to_string(index + 1) + "-" + figure_file_name(aggregate.protocol);
  return {{"profile-" + file,
           "Performance profile: share of instances with a final normalised error at or below the value. Higher is "
           "better; bands are 95 % confidence intervals.",
           profile},
          {"progress-" + file,
           "Convergence: mean normalised error by number of " + counts + ". The mean of a line over all " + counts +
               " is the error-curve area of the table.",
           progress}};
}

// The error landscape around the nominal pose of a scene.
std::optional<Figure> landscape_figure(const SceneFacts& facts, std::size_t index) {
  if (facts.landscape.empty()) return {};
  Chart chart;
  chart.title = facts.scene;
  chart.x = {"% of the travel from the nominal pose", false, false, {}};
  chart.y = {"noise-free error (" + facts.scored_by.label() + ")", false, false, {}, 0};
  for (const LandscapeLine& line : facts.landscape) {
    ChartSeries series = {line.axis, static_cast<int>(chart.series.size()), Drawn::line, {}};
    for (std::size_t k = 0; k < line.away.size(); ++k) series.points.push_back({line.away[k], line.score[k]});
    chart.series.push_back(std::move(series));
  }
  return Figure{"landscape-" + std::to_string(index + 1) + "-" + figure_file_name(facts.scene),
                "Error at poses displaced from the nominal one along one axis at a time.", chart};
}

}  // namespace relign::report
