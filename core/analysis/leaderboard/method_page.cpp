// The page of a method: who made it, its standings, results by scene and noise level, failures, replay, versions.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "leaderboard/page_frame.h"
#include "leaderboard/round.h"
#include "leaderboard/site.h"
#include "leaderboard/standings.h"
#include "report/page.h"
#include "report/picture_html.h"
#include "report/sections.h"

namespace relign::leaderboard {
namespace {

using report::number_text;
using report::Words;

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

using Facts = std::vector<std::pair<std::string, Words>>;

void add_fact(Facts& facts, const char* name, const std::string& value) {
  facts.emplace_back(name, Words{{value, "name"}});
}

void add_submission(Facts& facts, const Entry& entry) {
  const Submission& submission = entry.submission;
  add_fact(facts, "version", entry.evaluation.version);
  add_fact(facts, "authors", join(submission.authors, ", "));
  add_fact(facts, "licence", submission.licence);
  add_fact(facts, "citation", submission.citation);
  add_fact(facts, "homepage", submission.homepage);
  if (is_web_address(submission.homepage)) facts.back().second[0].link = submission.homepage;
  add_fact(facts, "archive", "sha256 " + entry.evaluation.archive_sha256);
  add_fact(facts, "evaluated", entry.evaluation.date + " by relign-bench " + entry.evaluation.program_version);
  for (const Caution& caution : entry.cautions) add_fact(facts, caution.tag, caution.text);
  facts.push_back({"report", Words{{"all results of this evaluation", "", "", kRoot + entry.report}}});
}

const report::Method* described(const Round& round, const std::string& method) {
  const std::set<std::string> names = names_of(round, method);
  for (const report::Method& one : round.page.methods)
    if (names.count(one.name)) return &one;
  return nullptr;
}

void facts_section(report::PageWriter& out, const Board& board, const Place& latest) {
  const report::Method* method = described(*latest.round, latest.standing->method);
  const Entry* entry = latest.standing->entry ? &board.entries[*latest.standing->entry] : nullptr;
  if (entry && !entry->submission.summary.empty())
    out.text(Words{{entry->submission.summary, "name"}});
  else if (method && !method->summary.empty())
    out.text(Words{{method->summary, "name"}});
  Facts facts;
  add_fact(facts, "observes",
           latest.of_class->observes.empty() ? "nothing but its own moves" : join(latest.of_class->observes, ", "));
  add_fact(facts, "training", training_text(latest.standing->training));
  if (method)
    add_fact(facts, "plugin", method->id + (method->plugin_hash.empty() ? "" : ", sha256 " + method->plugin_hash));
  if (entry)
    add_submission(facts, *entry);
  else
    add_fact(facts, "origin", "baseline: part of relign-bench, or of the organiser");
  out.facts(facts);
}

void standing_sections(report::PageWriter& out, const Board& board, const std::vector<Place>& places) {
  out.heading(2, "Standings");
  for (const Place& place : places) {
    const auto ranked = std::count_if(place.of_class->standings.begin(), place.of_class->standings.end(),
                                      [](const Standing& one) { return one.rank > 0; });
    const std::string rank = place.standing->rank > 0
                                 ? "rank " + std::to_string(place.standing->rank) + " of " + std::to_string(ranked)
                                 : "not ranked: " + place.standing->not_ranked;
    report::Table table = standings_table(
        board, "Suite " + place.round->suite.name + " of " + place.round->date.substr(0, 10) + ", " +
                   class_title(*place.of_class) + ", protocol " + place.of_class->protocol + ": " + rank);
    table.sortable = false;
    add_standing(table, board, *place.of_class, *place.standing, kRoot);
    out.table(table);
  }
}

void strata_section(report::PageWriter& out, const Round& round, const std::set<std::string>& names) {
  report::Table table = {
      "ranking",
      "Final results, suite " + round.suite.name + " of " + round.date.substr(0, 10),
      {{"scene, noise level", "", "", "name"},
       {"final error", report::common_score(round.page).label() + ", median (95 %)",
        "Noise-free, at the recommended pose", "number"},
       {"in spec", "of instances (95 %)", "Failed trials count as missed", "number"},
       {"moves to spec", "median", "Moves, each with a capture, until the specification is first met", "number"},
       {"machine time", "s, median", "Of one alignment", "number"},
       {"compute time", "ms per step", "Of the method; depends on the machine", "number"},
       {"failed", "trials", "", "number"}}};
  for (const report::Group& group : round.page.groups)
    for (const report::Row& row : group.rows) {
      if (!names.count(row.method)) continue;
      Words place = {{group.scene + ", " + group.noise_level, "name"}, {", protocol " + group.protocol}};
      if (row.training_tag != "" && row.training_tag != report::kOneTraining)
        place.add(" \u00b7 ").add(row.method, "name");
      const report::Score& score = row.score();
      table.add({{place, std::nullopt, "name"},
                 report::estimate_cell(score.median, number_text(score.median, 3),
                                       report::interval_text(score.interval, 3, report::kDash)),
                 row.yield ? report::share_cell(row.yield->share, row.yield->interval) : report::no_cell(),
                 report::arrival_cell(row.to_spec ? row.to_spec->steps : report::kMissing, {}),
                 report::number_cell(row.machine_seconds, 3),
                 report::number_cell(row.algorithm_ms_per_step, 2),
                 failed_cell(row.failed, row.trials + row.failed)});
    }
  out.table(table);
}

void failures_section(report::PageWriter& out, const Round& round, const std::set<std::string>& names) {
  std::set<std::string> labels;
  for (const report::Method& method : round.page.methods)
    if (names.count(method.name)) labels.insert(method.label);
  std::vector<Words> failures;
  for (const report::Failure& failure : round.page.failures)
    if (labels.count(failure.method))
      failures.push_back({{counted(failure.count, "trial") + ": "}, {failure.message, "name"}});
  if (!failures.empty()) out.heading(2, "Failures").list(failures, "plain");
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

void history_chart(report::PageWriter& out, const Board& board, const History& history) {
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
  const std::string caption = chart.title +
                              ", oldest first; the table has the numbers. Versions of different rounds met different "
                              "instances.";
  out.chart({"versions-of-" + report::figure_file_name(history.name), caption, std::move(chart)});
}

void history_section(report::PageWriter& out, const Board& board, const History& history) {
  report::Table table = {"ranking",
                         "Evaluations of " + history.name + ", latest first",
                         {{"version", "", "", "name"},
                          {"evaluated"},
                          {"suite"},
                          {"method, protocol"},
                          {"normalised error", "IQM (95 %)", "", "number"},
                          {"rank", "in its class", "", "number"},
                          {"failed", "trials", "", "number"}}};
  table.sortable = false;
  for (const Version& version : history.versions) {
    const Entry& entry = board.entries[version.entry];
    for (const Version::Result& result : version.results) {
      report::Cell name = {Words{{entry.evaluation.version, "name", "", kRoot + entry.report}}, std::nullopt, "name"};
      add_condition_flags(name.words, entry);
      table.add({std::move(name),
                 {entry.evaluation.date.substr(0, 10)},
                 {Words{{entry.evaluation.suite.name, "name"}}},
                 {Words{{result.method, "name"}, {", " + result.protocol}}},
                 report::number_cell(error_text(result.error)),
                 report::number_cell(result.rank > 0 ? std::to_string(result.rank) + " of " + std::to_string(result.of)
                                                     : "-"),
                 failed_cell(result.failed, result.trials)});
    }
  }
  out.heading(2, "Versions").table(table);
  if (history.versions.size() > 1) history_chart(out, board, history);
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
  SitePage page;
  Json charts = Json::array();
  report::PageWriter out(charts);
  Words title = {{method, "name"}};
  if (latest.standing->submitted) {
    title.add(" ").add("submitted", "mine");
    add_condition_flags(title, board.entries[*latest.standing->entry]);
  }
  add_failure_flag(title, latest.standing->failed, latest.standing->trials);
  out.heading(1, title);
  facts_section(out, board, latest);
  standing_sections(out, board, places);
  out.heading(2, "Results by scene and noise level");
  const Round* before = nullptr;
  for (const Place& place : places) {
    if (place.round == before) continue;
    before = place.round;
    strata_section(out, *place.round, names_of(*place.round, method));
  }
  failures_section(out, *latest.round, names_of(*latest.round, method));
  page.title = method + " - " + board.title;
  page.root = kRoot;
  page.board_title = board.title;
  page.main = out.take();
  const std::set<std::string> names = names_of(*latest.round, method);
  const report::Gallery films = films_of(latest.round->gallery, names);
  const report::PageModel groups = groups_with(latest.round->page, names);
  if (const std::string replay = report::replay_html({groups, films, {}}); !replay.empty()) {
    page.main += replay;
    page.definitions = report::picture_definitions(films);
    page.data["replay"] = report::replay_data(groups, films);
    for (const report::Group& group : groups.groups)
      page.data["groups"].push_back({{"label", group.label}, {"curves", Json::array()}});
  }
  report::PageWriter versions(charts);
  if (const History* history = history_of(board, places)) history_section(versions, board, *history);
  page.main += versions.take();
  page.data["charts"] = std::move(charts);
  return framed(page);
}

}  // namespace relign::leaderboard
