// The page of a method: who made it, its standings, results by scene and noise level, failures, replay, versions.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "leaderboard/page_frame.h"
#include "leaderboard/round.h"
#include "leaderboard/site.h"
#include "leaderboard/standings_html.h"
#include "report/picture_html.h"
#include "report/sections.h"
#include "report/svg_chart.h"

namespace relign::leaderboard {
namespace {

using report::interval_cell;
using report::number_text;

constexpr std::size_t kMaxPagePictureBytes = 4'000'000;
constexpr const char* kRoot = "../";

// Where a method is on the board.
struct Place {
  const Round* round = nullptr;
  const BoardClass* of_class = nullptr;
  const Standing* standing = nullptr;
};

std::vector<Place> places_of(const Board& board, const std::string& method) {
  std::vector<Place> places;
  for (const Round& round : board.rounds)
    for (const BoardClass& of_class : round.classes)
      for (const Standing& standing : of_class.standings)
        if (standing.method == method) places.push_back({&round, &of_class, &standing});
  return places;
}

// Names in the results: of the method, or of its trainings.
std::set<std::string> names_of(const Round& round, const std::string& method) {
  std::set<std::string> names = {method};
  for (const report::Aggregate& aggregate : round.page.aggregates)
    for (const report::AggregateMethod& one : aggregate.methods)
      if (one.method == method)
        for (const report::AggregateTraining& training : one.trainings) names.insert(training.name);
  return names;
}

// Only addresses that a browser opens as a page; others are shown as text.
bool is_web_address(const std::string& text) { return text.rfind("https://", 0) == 0 || text.rfind("http://", 0) == 0; }

void submission_facts(HtmlWriter& html, const Entry& entry) {
  const Submission& submission = entry.submission;
  fact(html, "version", entry.evaluation.version);
  fact(html, "authors", join(submission.authors, ", "));
  fact(html, "licence", submission.licence);
  fact(html, "citation", submission.citation);
  if (is_web_address(submission.homepage)) {
    html.element("dt", "homepage").open("dd");
    html.element("a", {{"href", submission.homepage}, {"rel", "nofollow noopener noreferrer"}}, submission.homepage);
    html.close();
  } else {
    fact(html, "homepage", submission.homepage);
  }
  fact(html, "archive", "sha256 " + entry.evaluation.archive_sha256);
  fact(html, "evaluated", entry.evaluation.date + " by relign-bench " + entry.evaluation.program_version);
  for (const Caution& caution : entry.cautions) {
    html.open("dt").element("span", {{"class", "flag"}}, caution.tag).close();
    html.element("dd", caution.text);
  }
  html.element("dt", "report").open("dd");
  html.element("a", {{"href", kRoot + entry.report}}, "all results of this evaluation").close();
}

const report::Method* described(const Round& round, const std::string& method) {
  const std::set<std::string> names = names_of(round, method);
  for (const report::Method& one : round.page.methods)
    if (names.count(one.name)) return &one;
  return nullptr;
}

void facts_section(HtmlWriter& html, const Board& board, const Place& latest) {
  const report::Method* method = described(*latest.round, latest.standing->method);
  const Entry* entry = latest.standing->entry ? &board.entries[*latest.standing->entry] : nullptr;
  if (entry && !entry->submission.summary.empty())
    html.open("p").element("bdi", entry->submission.summary).close();
  else if (method && !method->summary.empty())
    html.open("p").element("bdi", method->summary).close();
  html.open("dl");
  fact(html, "observes",
       latest.of_class->observes.empty() ? "nothing but its own moves" : join(latest.of_class->observes, ", "));
  fact(html, "training", training_text(latest.standing->training));
  if (method) fact(html, "plugin", method->id + (method->plugin_hash.empty() ? "" : ", sha256 " + method->plugin_hash));
  if (entry)
    submission_facts(html, *entry);
  else
    fact(html, "origin", "baseline: part of relign-bench, or of the organiser");
  html.close();
}

void standing_sections(HtmlWriter& html, const Board& board, const std::vector<Place>& places) {
  html.element("h2", "Standings");
  for (const Place& place : places) {
    std::size_t ranked = 0;
    for (const Standing& one : place.of_class->standings) ranked += one.rank > 0 ? 1 : 0;
    const std::string rank = place.standing->rank > 0
                                 ? "rank " + std::to_string(place.standing->rank) + " of " + std::to_string(ranked)
                                 : "not ranked: " + place.standing->not_ranked;
    standing_table(html, board, *place.of_class, *place.standing,
                   "Suite " + place.round->suite.name + " of " + place.round->date.substr(0, 10) + ", " +
                       class_title(*place.of_class) + ", protocol " + place.of_class->protocol + ": " + rank,
                   kRoot);
  }
}

void score_cell(HtmlWriter& html, const report::Score& score) {
  interval_cell(html, "number", report::sort_value(score.median), number_text(score.median, 3),
                report::interval_text(score.interval, 3, kTo));
}

void stratum_row(HtmlWriter& html, const report::Group& group, const report::Row& row) {
  html.open("tr").open("th", {{"scope", "row"}, {"class", "name"}});
  html.element("bdi", group.scene + ", " + group.noise_level).text(", protocol " + group.protocol);
  if (row.training_tag != "" && row.training_tag != report::kOneTraining)
    html.text(" \u00b7 ").element("bdi", row.method);
  html.close();
  score_cell(html, row.score());
  if (row.yield)
    interval_cell(
        html, "number", report::sort_value(row.yield->share), report::whole_percent(row.yield->share) + " %",
        report::whole_percent(row.yield->interval.low) + kTo + report::whole_percent(row.yield->interval.high));
  else
    interval_cell(html, "number", "", "-", "");
  const double steps = row.to_spec ? row.to_spec->steps : report::kMissing;
  html.element("td", {{"class", "number"}, {"data-sort", report::sort_value(steps)}},
               std::isinf(steps) ? "not reached" : number_text(steps, 3));
  html.element("td", {{"class", "number"}}, number_text(row.machine_seconds, 3));
  html.element("td", {{"class", "number"}}, number_text(row.algorithm_ms_per_step, 2));
  html.element("td", {{"class", row.failed > 0 ? "number bad" : "number"}},
               std::to_string(row.failed) + " of " + std::to_string(row.trials + row.failed));
  html.close();
}

void strata_section(HtmlWriter& html, const Round& round, const std::set<std::string>& names) {
  const std::string caption = "Final results, suite " + round.suite.name + " of " + round.date.substr(0, 10);
  open_scroll(html, caption);
  html.open("table", {{"class", "ranking sortable"}}).element("caption", caption).open("thead").open("tr");
  report::column_head(html, "name", "scene, noise level", "", "");
  report::column_head(html, "number", "final error", "RMSE, median (95 %)", "Noise-free, at the recommended pose");
  report::column_head(html, "number", "in spec", "of instances (95 %)", "Failed trials count as missed");
  report::column_head(html, "number", "moves to spec", "median",
                      "Moves, each with an image, until the specification is first met");
  report::column_head(html, "number", "machine time", "s, median", "Of one alignment");
  report::column_head(html, "number", "compute time", "ms per step", "Of the method; depends on the machine");
  report::column_head(html, "number", "failed", "trials", "");
  html.close().close().open("tbody");
  for (const report::Group& group : round.page.groups)
    for (const report::Row& row : group.rows)
      if (names.count(row.method)) stratum_row(html, group, row);
  html.close().close().close();
}

void failures_section(HtmlWriter& html, const Round& round, const std::set<std::string>& names) {
  std::set<std::string> labels;
  for (const report::Method& method : round.page.methods)
    if (names.count(method.name)) labels.insert(method.label);
  bool first = true;
  for (const report::Failure& failure : round.page.failures) {
    if (!labels.count(failure.method)) continue;
    if (first) html.element("h2", "Failures").open("ul", {{"class", "plain"}});
    first = false;
    html.open("li").text(counted(failure.count, "trial") + ": ").element("bdi", failure.message).close();
  }
  if (!first) html.close();
}

// The films of these methods only, within the limit of a page.
report::Gallery films_of(const report::Gallery& all, const std::set<std::string>& names) {
  report::Gallery own;
  own.axes = all.axes;
  std::map<std::size_t, std::size_t> places;
  std::size_t bytes = 0;
  const auto take = [&](std::optional<std::size_t>& picture) {
    if (!picture) return;
    const auto [place, is_new] = places.try_emplace(*picture, own.pictures.size());
    if (is_new && bytes + all.pictures[*picture].data_uri.size() > kMaxPagePictureBytes) {
      places.erase(place);
      picture.reset();
      return;
    }
    if (is_new) {
      own.pictures.push_back(all.pictures[*picture]);
      bytes += own.pictures.back().data_uri.size();
    }
    picture = place->second;
  };
  for (const auto& [scene, reference] : all.references) take((own.references[scene] = reference).picture);
  for (const report::TrialPictures& trial : all.trials) {
    if (!names.count(trial.algorithm)) continue;
    report::TrialPictures& kept = own.trials.emplace_back(trial);
    take(kept.film.picture);
    take(kept.end.picture);
    kept.start.picture.reset();  // it is the first capture of the film
  }
  return own;
}

// What the replay needs of the page: groups with this method alone.
report::PageModel groups_with(const report::PageModel& all, const std::set<std::string>& names) {
  report::PageModel page;
  for (const report::Group& group : all.groups) {
    report::Group kept;
    kept.scene = group.scene;
    kept.noise_level = group.noise_level;
    kept.protocol = group.protocol;
    kept.label = group.label;
    for (const report::Row& row : group.rows)
      if (names.count(row.method)) kept.rows.push_back(row);
    page.groups.push_back(std::move(kept));
  }
  return page;
}

void history_chart(HtmlWriter& html, const Board& board, const History& history) {
  report::Chart chart;
  chart.title = "Normalised error of the versions of " + history.name;
  chart.x.title = "version";
  chart.y = {"normalised error", false, false, {}, 0, 1};
  std::map<std::string, std::size_t> series;
  for (auto version = history.versions.rbegin(); version != history.versions.rend(); ++version) {
    const auto x = static_cast<double>(chart.x.categories.size());
    chart.x.categories.push_back(board.entries[version->entry].evaluation.version);
    for (const Version::Result& result : version->results) {
      const std::string name = result.method + ", " + result.protocol;
      const auto [place, is_new] = series.try_emplace(name, chart.series.size());
      if (is_new) chart.series.push_back({name, static_cast<int>(place->second), report::Drawn::marked_line, {}});
      if (result.error.n > 0)
        chart.series[place->second].points.push_back(
            {x, result.error.estimate, result.error.interval.low, result.error.interval.high});
    }
  }
  html.open("figure", {{"class", "plot"}});
  report::draw_chart(html, chart, report::ChartUse::in_page);
  html.element("figcaption", chart.title +
                                 ", oldest first; the table has the numbers. Versions of different rounds "
                                 "met different instances.");
  html.close();
}

void history_section(HtmlWriter& html, const Board& board, const History& history) {
  html.element("h2", "Versions");
  const std::string caption = "Evaluations of " + history.name + ", latest first";
  open_scroll(html, caption);
  html.open("table", {{"class", "ranking"}}).element("caption", caption).open("thead").open("tr");
  report::column_head(html, "name", "version", "", "");
  report::column_head(html, "plain", "evaluated", "", "");
  report::column_head(html, "plain", "suite", "", "");
  report::column_head(html, "plain", "method, protocol", "", "");
  report::column_head(html, "number", "normalised error", "IQM (95 %)", "");
  report::column_head(html, "number", "rank", "in its class", "");
  report::column_head(html, "number", "failed", "trials", "");
  html.close().close().open("tbody");
  for (const Version& version : history.versions) {
    const Entry& entry = board.entries[version.entry];
    for (const Version::Result& result : version.results) {
      html.open("tr").open("th", {{"scope", "row"}, {"class", "name"}});
      html.open("a", {{"href", kRoot + entry.report}}).element("bdi", entry.evaluation.version).close();
      condition_flags(html, entry);
      html.close().element("td", entry.evaluation.date.substr(0, 10));
      html.open("td").element("bdi", entry.evaluation.suite.name).close();
      html.open("td").element("bdi", result.method).text(", " + result.protocol).close();
      html.element("td", {{"class", "number"}}, error_text(result.error));
      html.element("td", {{"class", "number"}},
                   result.rank > 0 ? std::to_string(result.rank) + " of " + std::to_string(result.of) : "-");
      html.element("td", {{"class", result.failed > 0 ? "number bad" : "number"}},
                   std::to_string(result.failed) + " of " + std::to_string(result.trials));
      html.close();
    }
  }
  html.close().close().close();
  if (history.versions.size() > 1) history_chart(html, board, history);
}

const History* history_of(const Board& board, const std::vector<Place>& places) {
  for (const Place& place : places)
    if (place.standing->entry)
      for (const History& history : board.histories)
        if (history.name == board.entries[*place.standing->entry].evaluation.name) return &history;
  return nullptr;
}

}  // namespace

std::string method_html(const Board& board, const std::string& method) {
  const std::vector<Place> places = places_of(board, method);
  const Place& latest = places.at(0);
  HtmlWriter html;
  html.open("h1").element("bdi", method).close();
  if (latest.standing->submitted) {
    const Entry& entry = board.entries[*latest.standing->entry];
    html.text(" ").element("span", {{"class", "mine"}}, "submitted");
    condition_flags(html, entry);
  }
  failure_flag(html, latest.standing->failed, latest.standing->trials);
  facts_section(html, board, latest);
  standing_sections(html, board, places);
  html.element("h2", "Results by scene and noise level");
  const Round* before = nullptr;
  for (const Place& place : places) {
    if (place.round == before) continue;
    before = place.round;
    strata_section(html, *place.round, names_of(*place.round, method));
  }
  failures_section(html, *latest.round, names_of(*latest.round, method));
  SitePage page;
  page.title = method + " - " + board.title;
  page.root = kRoot;
  page.board_title = board.title;
  page.main = html.take();
  const std::set<std::string> names = names_of(*latest.round, method);
  const report::Gallery films = films_of(latest.round->gallery, names);
  const report::PageModel groups = groups_with(latest.round->page, names);
  if (const std::string strips = report::replay_section(groups, films); !strips.empty()) {
    page.main += replay_html(strips);
    page.definitions = report::picture_definitions(films);
    page.data = {{"replay", report::replay_data(groups, films)}, {"groups", Json::array()}};
    for (const report::Group& group : groups.groups) page.data["groups"].push_back({{"label", group.label}});
  }
  if (const History* history = history_of(board, places)) {
    HtmlWriter versions;
    history_section(versions, board, *history);
    page.main += versions.take();
  }
  return framed(page);
}

}  // namespace relign::leaderboard
