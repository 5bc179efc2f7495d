#include "leaderboard/standings_html.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/page_numbers.h"
#include "report/sections.h"

namespace relign::leaderboard {
namespace {

using report::interval_cell;
using report::interval_text;
using report::number_text;
using report::sort_value;
using report::whole_percent;

std::string percent_interval(const statistics::Interval& interval) {
  return interval.exists() ? whole_percent(interval.low) + kTo + whole_percent(interval.high) : "";
}

void share_cell(HtmlWriter& html, const statistics::Band& share) {
  if (share.n == 0) return interval_cell(html, "number", "", "-", "");
  interval_cell(html, "number", sort_value(share.estimate), whole_percent(share.estimate) + " %",
                percent_interval(share.interval));
}

void number_cell(HtmlWriter& html, double value, int digits = 3) {
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(value)}}, number_text(value, digits));
}

void name_cell(HtmlWriter& html, const Board& board, const Standing& standing, const std::string& root) {
  html.open(
      "th",
      {{"scope", "row"}, {"class", "name"}, {"data-sort", standing.rank > 0 ? std::to_string(standing.rank) : ""}});
  html.element("span", {{"class", "rank"}}, standing.rank > 0 ? std::to_string(standing.rank) : "\u2013").text(" ");
  html.open("a", {{"href", root + standing.page}}).element("bdi", standing.method).close();
  report::tag(html, standing.training_tag);
  if (standing.submitted) {
    const Entry& entry = board.entries[*standing.entry];
    html.text(" ").element("span", {{"class", "mine"}}, "submitted");
    condition_flags(html, entry);
    html.open("span", {{"class", "who"}}).text("version ").element("bdi", entry.evaluation.version);
    if (!entry.submission.authors.empty()) html.text(" \u00b7 ").element("bdi", join(entry.submission.authors, ", "));
    html.close();
  }
  html.close();
}

void replayed_cell(HtmlWriter& html, const Standing& standing) {
  const records::ReplayCounts& replays = standing.replays;
  html.open("td", {{"class", replays.replayed > 0 ? "number" : "number quiet"},
                   {"data-sort", std::to_string(replays.replayed)},
                   {"title", standing.replayed_by}});
  if (replays.replayed == 0)
    html.text("not replayed");
  else
    html.text(std::to_string(replays.replayed) + " of " + std::to_string(replays.recorded))
        .element("span", {{"class", "who"}}, standing.replayed_by);
  html.close();
}

void standing_row(HtmlWriter& html, const Board& board, const BoardClass& of_class, const Standing& standing,
                  const std::string& root) {
  html.open("tr", {{"class", of_class.oracles ? "oracle" : standing.rank == 1 ? "best" : "plain"}});
  name_cell(html, board, standing, root);
  if (standing.error.n == 0) {
    html.element("td", {{"class", "quiet words"}, {"colspan", "4"}}, "no aggregate: " + standing.not_ranked);
  } else {
    interval_cell(html, "number", sort_value(standing.error.estimate), number_text(standing.error.estimate, 3),
                  interval_text(standing.error.interval, 3, kTo));
    report::range_cell(html, standing.error);
    share_cell(html, standing.beats_baseline);
    share_cell(html, standing.beaten_by_best);
  }
  html.open("td",
            {{"class", standing.failed > 0 ? "number bad" : "number"}, {"data-sort", std::to_string(standing.failed)}});
  html.text(std::to_string(standing.failed) + " of " + std::to_string(standing.trials)).close();
  const double images = std::isfinite(standing.images) ? report::rounded(standing.images, 4) : standing.images;
  html.element("td", {{"class", "number"}, {"data-sort", sort_value(images)}},
               std::isfinite(images) ? shortest(images) : "-");
  number_cell(html, standing.seconds());
  replayed_cell(html, standing);
  html.element("td",
               {{"class", "number"}, {"data-sort", standing.training ? sort_value(standing.training->hours) : "0"}},
               standing.training ? number_text(standing.training->hours, 3) : "none");
  html.close();
}

void standings_head(HtmlWriter& html, const std::string& baseline) {
  html.open("thead").open("tr");
  report::column_head(html, "name", "method", "rank", "By the interquartile mean of the normalised error");
  report::column_head(html, "number", "normalised error", "IQM (95 %)",
                      "Interquartile mean over all instances, every scene and noise level with equal weight. 0: the "
                      "instance's own optimum; 1: no better than the start. A failed trial counts as 1");
  report::column_head(html, "range", "", "0 to 1", "The same on a scale from 0 to 1");
  report::column_head(html, "number", "better than " + baseline, "of instances (95 %)",
                      "Probability to end with a lower error than this method on the same instance; ties count half");
  report::column_head(html, "number", "behind the first", "of instances (95 %)",
                      "Probability that the first of the class ends with a lower error on the same instance. An "
                      "interval that includes 50 % does not separate the two");
  report::column_head(html, "number", "failed", "trials", "Trials that ended in an error; each counts as error 1");
  report::column_head(html, "number", "images", "median", "Images that the method took per alignment");
  report::column_head(html, "number", "time", "s, median",
                      "Machine time of one alignment and the method's own computing time");
  report::column_head(
      html, "number", "replayed", "trials",
      "Trials that 'relign-bench verify' ran again with equal numbers, by whom and with which version, as "
      "verify.json beside these records states");
  report::column_head(html, "number", "training", "hours", "Machine time of the training, once");
  html.close().close();
}

}  // namespace

std::string class_title(const BoardClass& of_class) {
  if (of_class.oracles) return "Oracles";
  return of_class.observes.empty() ? "Observes nothing but its own moves" : "Observes " + join(of_class.observes, ", ");
}

std::string error_text(const statistics::Band& error) {
  if (error.n == 0) return "-";
  const std::string interval = interval_text(error.interval, 3, kTo);
  return number_text(error.estimate, 3) + (interval.empty() ? "" : " (" + interval + ")");
}

std::string percent_text(const statistics::Band& share) {
  if (share.n == 0) return "-";
  const std::string interval = percent_interval(share.interval);
  return whole_percent(share.estimate) + " %" + (interval.empty() ? "" : " (" + interval + ")");
}

std::string training_text(const std::optional<TrainingCost>& training) {
  if (!training) return "none";
  std::vector<std::string> parts;
  if (std::isfinite(training->hours)) parts.push_back(number_text(training->hours, 3) + " h");
  if (std::isfinite(training->images)) parts.push_back(shortest(training->images) + " images");
  if (std::isfinite(training->steps)) parts.push_back(shortest(training->steps) + " steps");
  if (!training->hardware.empty()) parts.push_back(training->hardware);
  return parts.empty() ? "not stated" : join(parts, ", ");
}

void condition_flags(HtmlWriter& html, const Entry& entry) {
  for (const Caution& caution : entry.cautions)
    html.text(" ").element("span", {{"class", "flag"}, {"title", caution.text}}, caution.tag);
}

void failure_flag(HtmlWriter& html, std::size_t failed, std::size_t trials) {
  if (failed > 0)
    html.text(" ").element("span", {{"class", "flag"}, {"title", "Each counts as error 1."}},
                           std::to_string(failed) + " of " + counted(trials, "trial") + " failed");
}

void fact(HtmlWriter& html, const char* name, const std::string& value) {
  if (!value.empty()) html.element("dt", name).open("dd").element("bdi", value).close();
}

void open_scroll(HtmlWriter& html, const std::string& label) {
  html.open("div", {{"class", "scroll"}, {"role", "region"}, {"tabindex", "0"}, {"aria-label", label}});
}

void class_table(HtmlWriter& html, const Board& board, const BoardClass& of_class, const std::string& caption) {
  open_scroll(html, caption);
  html.open("table", {{"class", "ranking sortable"}}).element("caption", {{"class", "unseen"}}, caption);
  standings_head(html, board.baseline);
  html.open("tbody");
  for (const Standing& standing : of_class.standings) standing_row(html, board, of_class, standing, "");
  html.close().close().close();
}

void standing_table(HtmlWriter& html, const Board& board, const BoardClass& of_class, const Standing& standing,
                    const std::string& caption, const std::string& root) {
  open_scroll(html, caption);
  html.open("table", {{"class", "ranking"}}).element("caption", caption);
  standings_head(html, board.baseline);
  html.open("tbody");
  standing_row(html, board, of_class, standing, root);
  html.close().close().close();
}

}  // namespace relign::leaderboard
