#include "report/gates.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/json_members.h"
#include "base/text.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr double kMostFailed = 0.05;

Json gate(const char* name, bool ok, const std::string& text) { return {{"name", name}, {"ok", ok}, {"text", text}}; }

// Entries of the suite that are one algorithm under two names must come out alike.
void add_same_methods(Json& gates, const Json& data, const LoadedResults& results) {
  std::map<std::string, std::vector<std::string>> names;
  for (const Json& entry : list_of(results.manifest, "algorithms")) {
    Json what;
    for (const char* key : {"id", "plugin", "plugin_hash", "protocol", "merit", "steps", "parameters"})
      what[key] = entry.is_object() ? entry.value(key, Json()) : Json();
    names[what.dump()].push_back(text_of(entry, "name"));
  }
  for (const auto& entry : names) {
    const std::vector<std::string>& twins = entry.second;  // by its own name: lambdas capture it
    if (twins.size() < 2) continue;
    std::size_t tested = 0;
    std::string different;
    for (const Json& group : data["groups"])
      for (const Json& pair : list_of(group, "pairs")) {
        const auto is_twin = [&](const char* key) {
          return std::find(twins.begin(), twins.end(), text_of(pair, key)) != twins.end();
        };
        if (!is_twin("a") || !is_twin("b")) continue;
        ++tested;
        if (pair["p_holm"].is_number() && pair["p_holm"].get<double>() < 0.05)
          different = text_of(pair, "a") + " and " + text_of(pair, "b") + " on " + text_of(group, "label");
      }
    if (tested == 0) continue;
    gates.push_back(different.empty() ? gate("A/A", true, "A/A")
                                      : gate("A/A", false,
                                             "One algorithm under two names came out different: " + different +
                                                 ". By chance that happens in 5 of 100 studies; more often, something "
                                                 "besides the algorithm decides."));
  }
}

void add_replay(Json& gates, const LoadedResults& results) {
  std::error_code code;
  const fs::path file = results.folder / "verify.json";
  if (!fs::is_regular_file(file, code)) return;
  Json said;
  try {
    said = JsonSource::from_file(file).root();
  } catch (const Error&) {
    return;
  }
  const std::uint64_t replayed = count_of(said, "replayed"), equal = count_of(said, "equal");
  if (replayed == 0) return;
  const std::string share = std::to_string(equal) + "/" + std::to_string(replayed);
  gates.push_back(equal == replayed
                      ? gate("replay", true, "replay " + share)
                      : gate("replay", false,
                             "Replaying " + std::to_string(replayed) + " trials gave other numbers in " +
                                 std::to_string(replayed - equal) + " of them; 'relign-bench verify' says where."));
}

}  // namespace

Json gates_json(const Json& data, const LoadedResults& results) {
  Json gates = Json::array();
  const Json& ran = data["ran"];
  const std::uint64_t planned = count_of(ran, "planned"), missing = count_of(ran, "missing");
  const std::uint64_t failed = count_of(ran, "failed"), ended = planned - std::min(planned, missing);
  const std::string share = std::to_string(ended) + "/" + std::to_string(planned);
  if (planned > 0)
    gates.push_back(missing == 0 ? gate("ran", true, share + " ran")
                                 : gate("ran", false, "Only " + share + " trials have ended."));
  if (failed > 0 && ended > 0) {
    const double of_all = static_cast<double>(failed) / static_cast<double>(ended);
    if (of_all > kMostFailed)
      gates.push_back(gate("failures", false,
                           significant(100 * of_all, 2) + " % of the trials failed, and medians leave them out."));
  }
  add_same_methods(gates, data, results);
  add_replay(gates, results);
  return gates;
}

}  // namespace relign::report
