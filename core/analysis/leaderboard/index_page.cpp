// index.html: rounds with their classes, cost pictures, what was left out, how to read it.
#include <algorithm>
#include <cmath>
#include <set>

#include "base/text.h"
#include "leaderboard/page_frame.h"
#include "leaderboard/pareto.h"
#include "leaderboard/round.h"
#include "leaderboard/site.h"
#include "leaderboard/standings_html.h"
#include "report/svg_chart.h"

namespace relign::leaderboard {
namespace {

constexpr std::size_t kMostCurves = 12;

std::string round_id(std::size_t index) { return "round-" + std::to_string(index + 1); }

std::string strata_text(const Round& round) {
  std::vector<std::string> parts;
  for (const report::Stratum& stratum : round.strata)
    parts.push_back(stratum.scene + " at " + stratum.noise_level + " (" + counted(stratum.instances, "instance") + ")");
  return join(parts, ", ");
}

void round_facts(HtmlWriter& html, const Board& board, const Round& round) {
  html.open("dl");
  fact(html, "suite", round.suite.name + ", " + counted(round.steps, "step") + " per alignment");
  fact(html, "scenes", strata_text(round));
  fact(html, "baseline", round.about_baseline);
  fact(html, "latest evaluation", round.date);
  if (round.commitment.empty())
    fact(html, "instances", "open: anybody could draw them before the evaluation; set " + round.suite.instance_set);
  else if (round.secret.empty())
    fact(html, "instances", "sealed, commitment " + round.commitment + "; the secret is not published yet");
  else
    fact(html, "instances",
         "were sealed, commitment " + round.commitment + "; secret, published since: " + round.secret);
  std::set<std::string> checked;
  for (const std::size_t index : round.entries) checked.insert(board.entries[index].checked);
  fact(html, "checks", join({checked.begin(), checked.end()}, "; "));
  html.element("dt", "submissions").open("dd");
  bool first = true;
  for (const std::size_t index : round.entries) {
    const Entry& entry = board.entries[index];
    html.text(first ? "" : ", ").open("a", {{"href", entry.report}});
    html.element("bdi", entry.evaluation.name + " " + entry.evaluation.version).close();
    condition_flags(html, entry);
    first = false;
  }
  html.close().close();
}

void round_alarms(HtmlWriter& html, const Round& round) {
  if (round.alarms.empty()) return;
  html.open("div", {{"class", "broken"}, {"role", "note"}});
  html.element("p", "Failed checks; do not rely on these results:").open("ul");
  for (const std::string& alarm : round.alarms) html.element("li", alarm);
  html.close().close();
}

void missing_ranking(HtmlWriter& html, const Round& round) {
  const std::vector<std::string> reasons = reasons_without_ranking(round);
  if (reasons.empty()) return;
  html.open("div", {{"class", "broken"}, {"role", "note"}});
  html.element("p", "No method of this round is ranked:").open("ul");
  for (const std::string& reason : reasons) html.element("li", reason);
  html.close().close();
}

// Mean error after each image, of the best methods of a protocol.
void image_curves(HtmlWriter& html, const std::vector<const Standing*>& best, const std::string& protocol) {
  report::Chart chart;
  chart.title = "Mean normalised error after each image, protocol " + protocol;
  chart.x = {"images", false, true, {}};
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
  html.open("figure", {{"class", "plot"}});
  report::draw_chart(html, chart, report::ChartUse::in_page);
  html.element("figcaption", chart.title + "; the first image is at the start. At the end: " + join(words, "; ") + ".");
  html.close();
}

void cost_pictures(HtmlWriter& html, const Round& round, const std::string& protocol) {
  std::vector<const Standing*> ranked;
  for (const BoardClass& of_class : round.classes)
    if (!of_class.oracles && of_class.protocol == protocol)
      for (const Standing& standing : of_class.standings)
        if (standing.error.n > 0) ranked.push_back(&standing);
  if (ranked.size() < 2) return;
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Standing* a, const Standing* b) { return a->error.estimate < b->error.estimate; });
  CostPicture images{"Error against images", "images per alignment, median", "", false, {}};
  CostPicture seconds{"Error against time", "machine and computing time per alignment", "s", true, {}};
  CostPicture training{"Error against training", "training", "h", false, {}};
  for (const Standing* standing : ranked) {
    images.points.push_back({standing->method, standing->images, standing->error});
    seconds.points.push_back({standing->method, standing->seconds(), standing->error});
    training.points.push_back({standing->method, standing->training ? standing->training->hours : 0, standing->error});
  }
  html.element("h3", "Error against cost, protocol " + protocol);
  html.element(
      "p", {{"class", "quiet"}},
      "Methods of all classes except oracles; they do not observe the same. Filled: on the Pareto front. Bars: "
      "95 % confidence intervals.");
  html.open("div", {{"class", "figures"}});
  draw_costs(html, images);
  draw_costs(html, seconds);
  draw_costs(html, training);
  ranked.resize(std::min(ranked.size(), kMostCurves));
  image_curves(html, ranked, protocol);
  html.close();
}

void round_section(HtmlWriter& html, const Board& board, std::size_t index) {
  const Round& round = board.rounds[index];
  html.open("section", {{"aria-labelledby", round_id(index)}});
  html.open("h2", {{"id", round_id(index)}})
      .text("Round of ")
      .element("bdi", round.date.substr(0, 10))
      .text(": suite ");
  html.element("bdi", round.suite.name).close();
  round_alarms(html, round);
  missing_ranking(html, round);
  round_facts(html, board, round);
  std::vector<std::string> protocols;
  for (const BoardClass& of_class : round.classes) {
    if (std::find(protocols.begin(), protocols.end(), of_class.protocol) == protocols.end())
      protocols.push_back(of_class.protocol);
    const std::string title = class_title(of_class);
    html.open("h3").element("bdi", title);
    html.element("span", {{"class", "quiet"}},
                 " \u00b7 protocol " + of_class.protocol +
                     (of_class.oracles ? " \u00b7 not ranked: they observe the true start" : ""))
        .close();
    class_table(html, board, of_class, title + ", protocol " + of_class.protocol);
  }
  for (const std::string& protocol : protocols) cost_pictures(html, round, protocol);
  html.close();
}

void left_out_section(HtmlWriter& html, const Board& board) {
  if (board.left_out.empty()) return;
  html.open("section", {{"aria-labelledby", "left-out"}});
  html.element("h2", {{"id", "left-out"}}, "Left out");
  html.element("p", counted(board.left_out.size(), "evaluation") +
                        " cannot be shown, because parts are damaged or contradict each other, or a check failed.");
  html.open("ul", {{"class", "plain"}});
  for (const LeftOut& one : board.left_out) {
    html.open("li").element("bdi", one.folder).open("ul");
    for (const std::string& reason : one.reasons) html.element("li", reason);
    html.close().close();
  }
  html.close().close();
}

}  // namespace

std::string index_html(const Board& board) {
  HtmlWriter html;
  html.open("h1").element("bdi", board.title).close();
  html.element("p", {{"class", "intro"}},
               "Alignment methods, each on the same instances with the same number of images. A class has the methods "
               "that observe the same; methods of different classes are not ranked against each other. Every method "
               "has a page with its replay, its versions and its failures.");
  for (std::size_t index = 0; index < board.rounds.size(); ++index) round_section(html, board, index);
  left_out_section(html, board);
  SitePage page;
  page.title = board.title + " - relign-bench";
  page.board_title = board.title;
  page.main = html.take();
  for (std::size_t index = 0; index < board.rounds.size() && board.rounds.size() > 1; ++index)
    page.links.emplace_back("#" + round_id(index),
                            board.rounds[index].suite.name + ", " + board.rounds[index].date.substr(0, 10));
  if (!board.left_out.empty()) page.links.emplace_back("#left-out", "Left out");
  return framed(page);
}

}  // namespace relign::leaderboard
