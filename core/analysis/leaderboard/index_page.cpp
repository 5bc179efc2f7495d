// index.html: rounds with their classes, cost pictures, what was left out, how to read it.
#include <algorithm>
#include <cmath>
#include <set>

#include "base/text.h"
#include "leaderboard/page_frame.h"
#include "leaderboard/pareto.h"
#include "leaderboard/round.h"
#include "leaderboard/site.h"
#include "leaderboard/standings.h"

namespace relign::leaderboard {
namespace {

using report::Words;

constexpr std::size_t kMostCurves = 12;

std::string round_id(std::size_t index) { return "round-" + std::to_string(index + 1); }

std::string strata_text(const Round& round) {
  std::vector<std::string> parts;
  for (const report::Stratum& stratum : round.strata)
    parts.push_back(stratum.scene + " at " + stratum.noise_level + " (" + counted(stratum.instances, "instance") + ")");
  return join(parts, ", ");
}

void round_facts(report::PageWriter& out, const Board& board, const Round& round) {
  const std::string instances =
      round.commitment.empty() ? "open: anybody could draw them before the evaluation; set " + round.suite.instance_set
      : round.secret.empty()
          ? "sealed, commitment " + round.commitment + "; the secret is not published yet"
          : "were sealed, commitment " + round.commitment + "; secret, published since: " + round.secret;
  std::set<std::string> checked;
  Words submissions;
  for (const std::size_t index : round.entries) {
    const Entry& entry = board.entries[index];
    checked.insert(entry.checked);
    submissions.add(submissions.empty() ? "" : ", ");
    submissions.push_back({entry.evaluation.name + " " + entry.evaluation.version, "name", "", entry.report});
    add_condition_flags(submissions, entry);
  }
  const auto fact = [](const char* name, const std::string& value) {
    return std::pair<std::string, Words>(name, Words{{value, "name"}});
  };
  out.facts({fact("suite", round.suite.name + ", " + counted(round.steps, "step") + " per alignment"),
             fact("scenes", strata_text(round)),
             fact("baseline", round.about_baseline),
             fact("latest evaluation", round.date),
             fact("instances", instances),
             fact("checks", join({checked.begin(), checked.end()}, "; ")),
             {"submissions", submissions}});
}

void alarms(report::PageWriter& out, const std::string& what, const std::vector<std::string>& reasons) {
  if (!reasons.empty()) out.open("broken").text(what).list({reasons.begin(), reasons.end()}).close();
}

// Mean error after each capture, of the best methods of a protocol.
void capture_curves(report::PageWriter& out, const std::vector<const Standing*>& best, const std::string& protocol) {
  report::Chart chart;
  chart.title = "Mean normalised error after each capture, protocol " + protocol;
  chart.x = {"captures", false, true, {}};
  chart.y = {"mean normalised error", false, false, {}, 0, 1};
  chart.height = 300;
  std::vector<std::string> words;
  for (const Standing* standing : best) {
    report::ChartSeries series = {standing->method, static_cast<int>(chart.series.size()), report::Drawn::line, {}};
    for (std::size_t step = 0; step < standing->by_step.size(); ++step)
      series.points.push_back({static_cast<double>(step + 1), standing->by_step[step]});
    if (series.points.size() < 2) continue;
    words.push_back(standing->method + " " + report::number_text(series.points.back().y, 3));
    chart.series.push_back(std::move(series));
  }
  if (chart.series.empty()) return;
  const std::string caption =
      chart.title + "; the first capture is at the start. At the end: " + join(words, "; ") + ".";
  out.chart({"error-by-capture-" + protocol, caption, std::move(chart)});
}

void cost_charts(report::PageWriter& out, const Round& round, const std::string& protocol) {
  std::vector<const Standing*> ranked;
  for (const BoardClass& of_class : round.classes)
    if (!of_class.oracles && of_class.protocol == protocol)
      for (const Standing& standing : of_class.standings)
        if (standing.error.n > 0) ranked.push_back(&standing);
  if (ranked.size() < 2) return;
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Standing* a, const Standing* b) { return a->error.estimate < b->error.estimate; });
  CostPicture captures{"Error against captures", "captures per alignment, median", "", false, {}};
  CostPicture seconds{"Error against time", "machine and computing time per alignment", "s", true, {}};
  CostPicture training{"Error against training", "training", "h", false, {}};
  for (const Standing* standing : ranked) {
    captures.points.push_back({standing->method, standing->images, standing->error});
    seconds.points.push_back({standing->method, standing->seconds(), standing->error});
    training.points.push_back({standing->method, standing->training ? standing->training->hours : 0, standing->error});
  }
  out.heading(3, "Error against cost, protocol " + protocol)
      .text(
          "Methods of all classes except oracles; they do not observe the same. The line is the Pareto front. Bars: "
          "95 % confidence intervals.",
          "quiet");
  out.open("figures");
  for (const CostPicture* picture : {&captures, &seconds, &training})
    if (const auto figure = cost_figure(*picture)) out.chart(*figure);
  ranked.resize(std::min(ranked.size(), kMostCurves));
  capture_curves(out, ranked, protocol);
  out.close();
}

void round_section(report::PageWriter& out, const Board& board, std::size_t index) {
  const Round& round = board.rounds[index];
  out.heading(2, {{"Round of "}, {round.date.substr(0, 10), "name"}, {": suite "}, {round.suite.name, "name"}},
              round_id(index));
  alarms(out, "Failed checks; do not rely on these results:", round.alarms);
  alarms(out, "No method of this round is ranked:", reasons_without_ranking(round));
  round_facts(out, board, round);
  std::vector<std::string> protocols;
  for (const BoardClass& of_class : round.classes) {
    if (std::find(protocols.begin(), protocols.end(), of_class.protocol) == protocols.end())
      protocols.push_back(of_class.protocol);
    const std::string title = class_title(of_class);
    out.heading(3, {{title, "name"},
                    {" \u00b7 protocol " + of_class.protocol +
                         (of_class.oracles ? " \u00b7 not ranked: they observe the true start" : ""),
                     "quiet"}});
    report::Table table = standings_table(board, title + ", protocol " + of_class.protocol);
    for (const Standing& standing : of_class.standings) add_standing(table, board, of_class, standing, "");
    out.table(table);
  }
  for (const std::string& protocol : protocols) cost_charts(out, round, protocol);
}

void left_out_section(report::PageWriter& out, const Board& board) {
  if (board.left_out.empty()) return;
  out.heading(2, "Left out", "left-out")
      .text(counted(board.left_out.size(), "evaluation") +
            " cannot be shown, because parts are damaged or contradict each other, or a check failed.");
  for (const LeftOut& one : board.left_out)
    out.text(Words{{one.folder, "name"}}).list({one.reasons.begin(), one.reasons.end()}, "plain");
}

}  // namespace

std::string index_html(const Board& board) {
  SitePage page;
  report::PageWriter out(page.data["charts"] = Json::array());
  out.heading(1, Words{{board.title, "name"}})
      .text(
          "Alignment methods, each on the same instances with the same number of captures. A class has the methods "
          "that observe the same; methods of different classes are not ranked against each other. Every method has a "
          "page with its replay, its versions and its failures.",
          "intro");
  for (std::size_t index = 0; index < board.rounds.size(); ++index) round_section(out, board, index);
  left_out_section(out, board);
  page.title = board.title + " - relign-bench";
  page.board_title = board.title;
  page.main = out.take();
  for (std::size_t index = 0; index < board.rounds.size() && board.rounds.size() > 1; ++index)
    page.links.emplace_back("#" + round_id(index),
                            board.rounds[index].suite.name + ", " + board.rounds[index].date.substr(0, 10));
  if (!board.left_out.empty()) page.links.emplace_back("#left-out", "Left out");
  return framed(page);
}

}  // namespace relign::leaderboard
