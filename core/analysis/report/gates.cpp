#include "report/gates.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "base/displayed_rmse.h"
#include "base/json_members.h"
#include "base/text.h"
#include "records/folder_checks.h"
#include "records/replays.h"
#include "statistics/study.h"

namespace relign::report {
namespace {

constexpr double kMaxFailed = 0.05;

using Gates = std::vector<QualityGate>;

// A/A test: suite entries that differ only by name must not differ significantly.
void add_same_methods(Gates& gates, const PageModel& page, const LoadedResults& results) {
  std::map<std::string, std::vector<std::string>> names;
  for (const Json& entry : list_of(results.manifest, "algorithms")) {
    Json what;
    for (const char* key : {"id", "plugin", "plugin_hash", "protocol", "merit", "steps", "parameters"})
      what[key] = entry.is_object() ? entry.value(key, Json()) : Json();
    names[what.dump()].push_back(text_of(entry, "name"));
  }
  for (const auto& entry : names) {
    const std::vector<std::string>& twins = entry.second;  // not a structured binding, which lambdas cannot capture
    if (twins.size() < 2) continue;
    std::size_t tested = 0;
    std::string different;
    const std::string protocol = text_of(valid_json(entry.first), "protocol");
    for (const Group& group : page.groups)
      for (const Pair& pair : group.pairs) {
        if (!protocol.empty() && group.protocol != protocol) continue;
        const auto is_twin = [&](const std::string& name) {
          return std::find(twins.begin(), twins.end(), name) != twins.end();
        };
        if (!is_twin(pair.a) || !is_twin(pair.b)) continue;
        ++tested;
        if (pair.p_holm < 0.05) different = pair.a + " and " + pair.b + " on " + group.label;
      }
    if (tested == 0) continue;
    gates.push_back(different.empty()
                        ? QualityGate{"A/A", true, "A/A"}
                        : QualityGate{"A/A", false,
                                      "Two names of the same algorithm differ significantly: " + different +
                                          ". By chance this happens in 5 of 100 studies; more likely the "
                                          "results depend on something other than the algorithm."});
  }
}

// The checks of the folder that need no replay.
void add_checks(Gates& gates, const records::Checks& checks) {
  for (const records::Check& check : checks) {
    if (!check.failed()) continue;
    const std::size_t more = check.findings.size() - 1 + check.more;
    gates.push_back({check.name, false,
                     check.findings.front() + (more > 0 ? ", and " + std::to_string(more) + " more" : "") + "."});
  }
  if (!checks.empty() && !records::any_failed(checks)) gates.push_back({"checks", true, records::summary_of(checks)});
}

void add_replay(Gates& gates, const LoadedResults& results) {
  const std::optional<records::Replays> replays = records::read_replays(results.folder);
  if (!replays || replays->all.replayed == 0) return;
  const auto [recorded, replayed, equal] = replays->all;
  const std::string share = std::to_string(equal) + "/" + std::to_string(replayed) +
                            (recorded > replayed ? " of " + std::to_string(recorded) + " trials" : "");
  gates.push_back(equal == replayed
                      ? QualityGate{"replay", true, "replay " + share}
                      : QualityGate{"replay", false,
                                    std::to_string(replayed - equal) + " of " + std::to_string(replayed) +
                                        " replayed trials gave different numbers; 'relign-bench verify' lists them."});
}

// Up to three of them: "bo-gp on relign_od rho0 #3 (..)".
std::string quoted_list(const std::vector<std::string>& trials) {
  constexpr std::size_t kMaxNamed = 3;
  std::string words;
  for (std::size_t i = 0; i < std::min(trials.size(), kMaxNamed); ++i) words += (i ? ", " : "") + trials[i];
  return words + (trials.size() > kMaxNamed ? " and " + std::to_string(trials.size() - kMaxNamed) + " more" : "");
}

// Results that are impossible unless something is wrong.
void add_alarms(Gates& gates, const LoadedResults& results) {
  // Both are estimates with a standard error of about 1.4e-7 in MSE, and the optimum is the result of a search.
  constexpr double kMinBelow = 1e-6, kShareBelow = 0.1;
  constexpr double kOtherCpu = 1e-6;  // relative: numbers are bit-identical on one type of processor only
  const statistics::TrialTable& table = results.trials;
  std::set<std::string> stations;
  for (const Json& scene : list_of(results.manifest, "scenes"))
    if (flag_of(scene, "owns_stage")) stations.insert(text_of(scene, "name"));
  std::set<std::string> by_image;  // methods whose merit does not contain the RMSE
  for (const Json& entry : list_of(results.manifest, "algorithms"))
    if (const std::string name = text_of(entry, "merit"); name == "mtf" || name == "edge_energy")
      by_image.insert(text_of(entry, "name"));
  const auto label = [&table](const statistics::TrialRow& row) {
    const statistics::Series& series = table.series_of(row);
    return series.algorithm + " on " + series.scene + " " + series.noise_level + " " + series.protocol + " #" +
           std::to_string(row.instance);
  };
  std::vector<std::string> below, merit, starts, optima;
  std::map<std::tuple<std::string, std::string, std::string, std::uint64_t>, const statistics::TrialRow*> first;
  const auto differ = [](double a, double b) { return std::abs(a - b) > kOtherCpu * std::abs(a); };  // false for NaN
  for (const statistics::TrialRow& row : table.rows) {
    const statistics::Series& series = table.series_of(row);
    if (row.impossible_merit && by_image.count(series.algorithm) == 0) merit.push_back(label(row));
    const double own = row.own_optimum_mse;  // an unbiased estimate, may be negative
    if (std::any_of(statistics::kRules.begin(), statistics::kRules.end(), [&](statistics::Rule rule) {
          const double rmse = row.last_of(statistics::track_of(rule));
          return own - rmse * rmse > std::max(kMinBelow, kShareBelow * own);
        }))
      below.push_back(label(row));
    if (row.steps == 0 || stations.count(series.scene) > 0) continue;
    const auto [known, is_new] =
        first.try_emplace({series.scene, series.noise_level, series.protocol, row.instance}, &row);
    if (!is_new && (differ(known->second->start_measured, row.start_measured) ||
                    differ(known->second->start_commanded, row.start_commanded)))
      starts.push_back(label(row) + " against " + table.series_of(*known->second).algorithm);
    if (!is_new && differ(known->second->own_optimum_mse, own))
      optima.push_back(label(row) + " against " + table.series_of(*known->second).algorithm);
  }
  if (!below.empty())
    gates.push_back({"optimum", false,
                     "Errors are clearly below the instance's own optimum, so that the error or the optimum is "
                     "wrong: " +
                         quoted_list(below) + "."});
  if (!optima.empty())
    gates.push_back(
        {"optimum", false, "The own optimum of one instance differs between methods: " + quoted_list(optima) + "."});
  if (!starts.empty())
    gates.push_back({"start", false,
                     "Step 0 differs between methods on the same instance, although they start at the same pose "
                     "under one protocol: " +
                         quoted_list(starts) + "."});
  if (!merit.empty())
    gates.push_back({"merit", false,
                     "A merit is negative or below the measured RMSE, which it includes: " + quoted_list(merit) + "."});
}

}  // namespace

std::vector<QualityGate> quality_gates(const PageModel& page, const LoadedResults& results) {
  Gates gates;
  const RunState& ran = page.ran;
  const std::size_t ended = ran.planned - ran.missing;
  const std::string share = std::to_string(ended) + "/" + std::to_string(ran.planned);
  if (ran.planned > 0)
    gates.push_back(ran.missing == 0 ? QualityGate{"ran", true, share + " ran"}
                                     : QualityGate{"ran", false, "Only " + share + " trials have ended."});
  if (ran.failed > 0) {
    const double of_all = static_cast<double>(ran.failed) / static_cast<double>(ended);
    if (of_all > kMaxFailed)
      gates.push_back(
          {"failures", false, significant(100 * of_all, 2) + " % of the trials failed; medians exclude them."});
  }
  add_checks(gates, results.checks);
  add_same_methods(gates, page, results);
  add_replay(gates, results);
  if (results.manifest.contains("sandbox")) gates.push_back({"sandbox", true, "algorithms in a sandbox"});
  add_alarms(gates, results);
  return gates;
}

}  // namespace relign::report
