#include "report/gates.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/text.h"
#include "records/folder_checks.h"
#include "records/replays.h"

namespace relign::report {
namespace {

constexpr double kMaxFailed = 0.05;

using Gates = std::vector<QualityGate>;

// A/A test: suite entries that differ only by name must not differ significantly.
void add_same_methods(Gates& gates, const PageModel& page, const LoadedResults& results) {
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> names;  // by protocol and all else
  for (const records::ManifestMethod& entry : results.manifest.algorithms)
    names[{entry.protocol,
           Json{entry.id, entry.plugin, entry.plugin_hash, entry.merit, entry.steps, entry.parameters}.dump()}]
        .push_back(entry.name);
  for (const auto& entry : names) {
    const std::vector<std::string>& twins = entry.second;  // not a structured binding, which lambdas cannot capture
    if (twins.size() < 2) continue;
    std::size_t tested = 0;
    std::string different;
    for (const Group& group : page.groups)
      for (const Pair& pair : group.pairs) {
        if (group.protocol != entry.first.first) continue;
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
  if (results.manifest.sandbox) gates.push_back({"sandbox", true, "algorithms in a sandbox"});
  return gates;
}

}  // namespace relign::report
