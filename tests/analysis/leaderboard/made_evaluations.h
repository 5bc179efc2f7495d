// Synthetic evaluation folders for one test.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "leaderboard/board.h"
#include "report/made_results.h"

namespace relign::leaderboard {

struct MadeMethod {
  std::string name;
  std::vector<std::string> observes;
  double error = 0.1;  // after the last step; the start has 0.2 and the own optimum 0.001
  bool submitted = false;
  std::vector<std::uint64_t> fails = {};  // instances
  std::string protocol = "blind";
  Json parameters = Json::object();
  std::string plugin = {};  // empty: as the name
  unsigned steps = 2;       // 1 or 2
};

class MadeEvaluations : public report::MadeResults {
 protected:
  static constexpr std::uint64_t kInstances = 8;

  // Writes FOLDER/name with one submitted method and others. `change` is merged into evaluation.json, the others into
  // the results' manifest and the suite in it.
  std::filesystem::path evaluation(const std::string& folder, const std::vector<MadeMethod>& methods,
                                   const Json& change = Json::object(), const Json& in_manifest = Json::object(),
                                   const Json& in_suite = Json::object()) {
    const std::filesystem::path place = folder_ / folder;
    write_results(place / "results", methods, in_manifest, in_suite);
    const MadeMethod* own = &methods.front();
    Json listed = Json::array();
    for (const MadeMethod& method : methods) {
      if (method.submitted) own = &method;
      listed.push_back({{"name", method.name},
                        {"observes", method.observes},
                        {"protocol", method.protocol},
                        {"training", nullptr},
                        {"submitted", method.submitted}});
    }
    Json written = {{"format", "relign-bench/evaluation/1"},
                    {"name", own->name},
                    {"version", "1.0"},
                    {"archive_sha256", std::string(64, 'a')},
                    {"suite", {{"name", "made"}, {"sha256", std::string(64, 'b')}, {"instance_set", "set-1"}}},
                    {"sealed", false},
                    {"sandbox", false},
                    {"date", "2026-11-24"},
                    {"program_version", "0.1.0"},
                    {"class", own->observes},
                    {"budget", {{"steps", 2}}},
                    {"methods", listed},
                    {"results", "results"}};
    written.merge_patch(change);
    write_file_atomically(place / "evaluation.json", written.dump(1));
    write_file_atomically(place / "submission.json", Json({{"name", written["name"]},
                                                           {"version", written["version"]},
                                                           {"summary", "A test."},
                                                           {"authors", {"A. Tester"}},
                                                           {"licence", "MIT"},
                                                           {"algorithm", {{"use", "x"}}}})
                                                         .dump());
    return place;
  }

  static void write_results(const std::filesystem::path& results, const std::vector<MadeMethod>& methods,
                            const Json& in_manifest, const Json& in_suite) {
    std::filesystem::create_directories(results);
    records::ResultsWriter writer(results);
    Json order = Json::array(), algorithms = Json::array();
    for (const MadeMethod& method : methods) {
      algorithms.push_back(
          {{"name", method.name},
           {"id", method.plugin.empty() ? method.name : method.plugin},
           {"plugin", method.plugin.empty() ? method.name : method.plugin},
           {"plugin_hash", std::string(64, 'c')},
           {"observes", method.observes},
           {"protocol", method.protocol},
           {"merit", "rmse"},
           {"oracle", method.name == "home" &&
                          std::count(method.observes.begin(), method.observes.end(), std::string("start")) > 0},
           {"added", false},
           {"steps", method.steps},
           {"parameters", method.parameters}});
      for (std::uint64_t instance = 0; instance < kInstances; ++instance) {
        const double last = method.error * (1 + 0.01 * static_cast<double>(instance));
        records::TrialRecord record =
            trial(method.name + method.protocol, instance,
                  method.steps == 1 ? std::vector{0.2, last} : std::vector{0.2, 0.5 * (0.2 + last), last});
        record.algorithm = method.name;
        record.algorithm_id = method.plugin.empty() ? method.name : method.plugin;
        record.protocol = method.protocol;
        record.own_optimum.mse = 1e-6;
        if (std::count(method.fails.begin(), method.fails.end(), instance) > 0) {
          record.end = "failed";
          record.message = "it broke: " + method.name;
        }
        records::TrialTimes times;
        times.trial = record.trial;
        times.algorithm_seconds.assign(record.steps.size(), 0.001);
        times.simulation_seconds = times.truth_seconds = times.algorithm_seconds;
        writer.append(order.size(), record, times);
        order.push_back(record.trial);
      }
    }
    Json manifest = {{"format", 1},
                     {"suite_name", "made"},
                     {"instances", kInstances},
                     {"instance_set", "set-1"},
                     {"scenes", {{{"name", "relign_od"}, {"truth", true}}}},
                     {"noise_levels", {{{"name", "rho0"}}}},
                     {"algorithms", algorithms},
                     {"trials", order.size()},
                     {"order", order},
                     {"seed", 1},
                     {"program", {{"version", "0.1.0"}}}};
    manifest.merge_patch(in_manifest);
    Json suite = {{"instances", manifest["instances"]}};
    for (const char* key : {"scenes", "noise_levels"})
      for (const Json& entry : manifest[key]) suite[key].push_back(entry["name"]);
    for (const MadeMethod& method : methods)
      suite["algorithms"].push_back({{"use", method.plugin.empty() ? method.name : method.plugin},
                                     {"name", method.name},
                                     {"protocol", method.protocol},
                                     {"merit", "rmse"},
                                     {"steps", method.steps}});
    suite.merge_patch(in_suite);
    manifest["suite"] = suite.dump();
    writer.write_manifest(records::made_manifest(manifest));
  }

  static Board board_of(const std::vector<std::filesystem::path>& folders, const std::string& baseline = "random") {
    BoardOptions options;
    options.folders = folders;
    options.baseline = baseline;
    return make_board(options);
  }

  // What everybody is compared with.
  static MadeMethod random() { return {"random", {"merit", "box"}, 0.15}; }
};

}  // namespace relign::leaderboard
