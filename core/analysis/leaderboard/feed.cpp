#include "leaderboard/feed.h"

#include "report/json_put.h"

namespace relign::leaderboard {
namespace {

using report::put;

Json band_json(const statistics::Band& band) {
  if (band.n == 0) return nullptr;
  Json json;
  put(json, "estimate", band.estimate);
  report::put_interval(json, band.interval);
  return json;
}

Json training_json(const std::optional<TrainingCost>& training) {
  if (!training) return nullptr;
  Json json;
  put(json, "steps", training->steps, "images", training->images, "hours", training->hours, "hardware",
      training->hardware);
  return json;
}

Json standing_json(const Standing& standing, const Board& board) {
  Json json = {{"rank", standing.rank > 0 ? Json(standing.rank) : Json()},
               {"method", standing.method},
               {"page", standing.page},
               {"submission", nullptr},
               {"error", band_json(standing.error)},
               {"mean_error", band_json(standing.mean_error)},
               {"beats_baseline", band_json(standing.beats_baseline)},
               {"beaten_by_best", band_json(standing.beaten_by_best)},
               {"training", training_json(standing.training)}};
  put(json, "trials", standing.trials, "failed", standing.failed, "images", standing.images, "machine_seconds",
      standing.machine_seconds, "compute_seconds", standing.compute_seconds);
  json["replayed"] = {{"trials", standing.replays.replayed},
                      {"of", standing.replays.recorded},
                      {"by", standing.replayed_by.empty() ? Json() : Json(standing.replayed_by)}};
  if (!standing.not_ranked.empty()) json["not_ranked"] = standing.not_ranked;
  if (!standing.entry) return json;
  const Entry& entry = board.entries[*standing.entry];
  json["submission"] = {{"name", entry.submission.name},
                        {"version", entry.submission.version},
                        {"authors", entry.submission.authors},
                        {"licence", entry.submission.licence}};
  return json;
}

Json round_json(const Round& round, const Board& board) {
  Json strata = Json::array(), classes = Json::array();
  for (const report::Stratum& stratum : round.strata)
    strata.push_back(
        {{"scene", stratum.scene}, {"noise_level", stratum.noise_level}, {"instances", stratum.instances}});
  for (const BoardClass& of_class : round.classes) {
    Json methods = Json::array();
    for (const Standing& standing : of_class.standings) methods.push_back(standing_json(standing, board));
    classes.push_back({{"observes", of_class.observes},
                       {"protocol", of_class.protocol},
                       {"ranked", !of_class.oracles},
                       {"methods", methods}});
  }
  const auto text_or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  Json json = {{"suite",
                {{"name", round.suite.name},
                 {"sha256", round.suite.sha256},
                 {"instance_set", round.suite.instance_set},
                 {"commitment", text_or_null(round.commitment)},
                 {"secret", text_or_null(round.secret)}}},
               {"date", round.date},
               {"steps", round.steps},
               {"strata", strata},
               {"alarms", round.alarms},
               {"classes", classes}};
  if (!round.about_baseline.empty()) json["baseline"] = round.about_baseline;
  if (const auto reasons = reasons_without_ranking(round); !reasons.empty()) json["not_ranked"] = reasons;
  return json;
}

Json version_json(const Version& version, const Board& board) {
  const Entry& entry = board.entries[version.entry];
  Json results = Json::array();
  for (const Version::Result& result : version.results)
    results.push_back({{"method", result.method},
                       {"protocol", result.protocol},
                       {"error", band_json(result.error)},
                       {"trials", result.trials},
                       {"failed", result.failed},
                       {"rank", result.rank > 0 ? Json(result.rank) : Json()},
                       {"of", result.of}});
  return {{"version", entry.evaluation.version},
          {"date", entry.evaluation.date},
          {"instance_set", entry.evaluation.suite.instance_set},
          {"archive_sha256", entry.evaluation.archive_sha256},
          {"sealed", entry.evaluation.sealed},
          {"sandbox", entry.evaluation.sandbox},
          {"checks", entry.checked},
          {"report", entry.report},
          {"results", results}};
}

}  // namespace

Json feed(const Board& board) {
  Json rounds = Json::array(), submissions = Json::array(), left_out = Json::array();
  for (const Round& round : board.rounds) rounds.push_back(round_json(round, board));
  for (const History& history : board.histories) {
    Json versions = Json::array();
    for (const Version& version : history.versions) versions.push_back(version_json(version, board));
    submissions.push_back({{"name", history.name}, {"versions", versions}});
  }
  for (const LeftOut& one : board.left_out) left_out.push_back({{"folder", one.folder}, {"reasons", one.reasons}});
  return {{"format", kFeedFormat}, {"title", board.title},       {"baseline", board.baseline},
          {"rounds", rounds},      {"submissions", submissions}, {"left_out", left_out}};
}

}  // namespace relign::leaderboard
