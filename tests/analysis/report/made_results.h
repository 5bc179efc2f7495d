// Synthetic results folders for one test, written by the same writer as a run's.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/hash.h"
#include "records/results_folder.h"
#include "results/records/made_manifest.h"

namespace relign::report {

class MadeResults : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("relign-report-" + std::string(test->name()) + "-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // A trial with these errors at step 0, 1, ..., both recommended and commanded.
  static records::TrialRecord trial(const std::string& algorithm, std::uint64_t instance,
                                    const std::vector<double>& errors, const std::string& level = "rho0") {
    records::TrialRecord record;
    record.trial = short_id(level + algorithm + std::to_string(instance));
    record.scene = "relign_od";
    record.noise_level = level;
    record.protocol = "paper";
    record.algorithm = record.algorithm_id = algorithm;
    record.instance = instance;
    record.end = "budget_spent";
    record.budget = errors.empty() ? 0 : static_cast<unsigned>(errors.size() - 1);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      records::StepRecord step;
      step.step = static_cast<unsigned>(i);
      step.commanded_pose = step.true_pose = step.recommended_pose = step.recommended_true_pose = {0.5};
      step.recommendation = "own";
      step.measured = step.merit = errors[i] + 0.03;
      step.machine_seconds = step.recommended_seconds = 0.5 * static_cast<double>(i);
      step.commanded_mse = step.recommended_mse = errors[i] * errors[i];
      record.steps.push_back(step);
    }
    return record;
  }

  // Writes manifest and trials; `extra` further trials are planned but not run. A trial with fewer steps than others of
  // its method has finished early.
  void write(std::vector<records::TrialRecord> trials, const std::string& suite_name = "made", std::size_t extra = 0) {
    records::ResultsWriter writer(folder_);
    records::Manifest manifest;
    std::map<std::pair<std::string, std::string>, unsigned> budgets;
    for (const records::TrialRecord& one : trials) {
      unsigned& budget = budgets[{one.algorithm, one.protocol}];
      budget = std::max(budget, one.budget);
    }
    for (std::size_t i = 0; i < trials.size(); ++i) {
      records::TrialRecord& one = trials[i];
      const unsigned budget = budgets[{one.algorithm, one.protocol}];
      if (one.budget < budget && one.end == "budget_spent") one.end = "finished";
      one.budget = budget;
      records::TrialTimes times;
      times.trial = one.trial;
      times.algorithm_seconds.assign(one.steps.size(), 0.001);
      times.simulation_seconds = times.truth_seconds = times.algorithm_seconds;
      writer.append(i, one, times);
      manifest.instances = std::max(manifest.instances, one.instance + 1);
      add_named(manifest.scenes, one.scene).owns_stage = one.protocol == "blind" && one.scene == "bench";
      add_named(manifest.noise_levels, one.noise_level);
      if (!manifest.method(one.algorithm, one.protocol)) {
        records::ManifestMethod& method = manifest.algorithms.emplace_back();
        method.name = one.algorithm;
        method.id = one.algorithm_id;
        method.protocol = one.protocol;
        method.observes = {"merit", "box"};
        method.merit = "combined";
        method.steps = budget;
        method.kind = "optimizer";
      }
    }
    if (trials.empty()) {
      add_named(manifest.scenes, "relign_od");
      add_named(manifest.noise_levels, "rho0");
      add_named(manifest.algorithms, "a").kind = "optimizer";
    }
    sort_order(manifest, trials);
    for (std::size_t i = 0; i < extra; ++i) manifest.order.push_back("never-run-" + std::to_string(i));
    manifest.suite_name = suite_name;
    manifest.trials = manifest.order.size();
    manifest.program.version = "0.1.0";
    manifest.suite = suite_of(json_of(manifest)).dump();
    writer.write_manifest(manifest);
  }

  // As a plan has it: by scene, noise level, method and instance.
  static void sort_order(records::Manifest& manifest, std::vector<records::TrialRecord> trials) {
    const auto place = [](const auto& entries, const auto& is) {
      return std::find_if(entries.begin(), entries.end(), is) - entries.begin();
    };
    const auto key = [&](const records::TrialRecord& one) {
      return std::tuple(
          place(manifest.scenes, [&](const auto& entry) { return entry.name == one.scene; }),
          place(manifest.noise_levels, [&](const auto& entry) { return entry.name == one.noise_level; }),
          place(manifest.algorithms,
                [&](const auto& entry) { return entry.key() == records::method_key(one.algorithm, one.protocol); }),
          one.instance);
    };
    std::stable_sort(trials.begin(), trials.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
    for (const records::TrialRecord& one : trials) manifest.order.push_back(one.trial);
  }

  template <class Entry>
  static Entry& add_named(std::vector<Entry>& entries, const std::string& name) {
    for (Entry& entry : entries)
      if (entry.name == name) return entry;
    entries.emplace_back().name = name;
    return entries.back();
  }

  // A suite that would give this manifest.
  static Json suite_of(const Json& manifest) {
    Json suite = {{"name", manifest["suite_name"]}};
    for (const char* key : {"scenes", "noise_levels"})
      for (const Json& entry : manifest[key]) suite[key].push_back(entry["name"]);
    std::set<std::string> listed;
    for (const Json& method : manifest["algorithms"])
      if (const Json name = method.contains("of_list") ? method["of_list"]["method"] : method["name"];
          !method["added"].get<bool>() && listed.insert(Json{name, method["protocol"]}.dump()).second)
        suite["algorithms"].push_back({{"use", method["id"]},
                                       {"name", name},
                                       {"protocol", method["protocol"]},
                                       {"merit", method["merit"]},
                                       {"steps", method["steps"]}});
    for (const char* key :
         {"instances", "seed", "first_instance", "spec", "limits", "machine_time", "cycle", "cost", "targets"})
      if (manifest.contains(key) && !manifest[key].is_null() && !(manifest[key].is_array() && manifest[key].empty()))
        suite[key] = manifest[key];
    return suite;
  }

  // A trial on a station, which measures but has no ground truth.
  static records::TrialRecord on_station(const std::string& algorithm, const std::vector<double>& measured) {
    records::TrialRecord record = trial(algorithm, 0, measured, "none");
    record.scene = "bench";
    record.protocol = "blind";
    for (std::size_t i = 0; i < measured.size(); ++i) {
      records::StepRecord& step = record.steps[i];
      step.measured = step.merit = measured[i];
      step.commanded_mse = step.recommended_mse = step.recommended_seconds = std::numeric_limits<double>::quiet_NaN();
    }
    return record;
  }

  // Adds members of a run's manifest: scenes, algorithms, ...; and to the suite, if the run has them from there.
  void add_to_manifest(const Json& more) {
    Json manifest = Json::parse(read_file(folder_ / "manifest.json"));
    const Json before = manifest;
    manifest.update(more);
    for (const char* key : {"scenes", "noise_levels", "algorithms"})
      if (more.contains(key))
        for (Json& entry : manifest[key]) entry = added_to(before[key], entry);
    manifest = records::completed<records::Manifest>(manifest);
    if (!more.contains("suite")) {
      const Json suite_before = Json::parse(manifest["suite"].get<std::string>());
      Json suite = suite_of(manifest);
      if (suite_before.contains("analysis")) suite["analysis"] = suite_before["analysis"];
      manifest["suite"] = suite.dump();
    }
    write_file_atomically(folder_ / "manifest.json", manifest.dump());
  }

  // `more` over the entry of this name (and protocol, if given) in the list.
  static Json added_to(const Json& list, const Json& more) {
    for (const Json& entry : list) {
      if (entry["name"] != more["name"] || (more.contains("protocol") && entry["protocol"] != more["protocol"]))
        continue;
      Json merged = entry;
      merged.update(more);
      return merged;
    }
    return more;
  }

  // Adds an analysis plan to suite and manifest, and further members.
  void add_plan(const Json& plan, const Json& more = Json::object()) {
    add_to_manifest(more);
    Json suite = Json::parse(Json::parse(read_file(folder_ / "manifest.json"))["suite"].get<std::string>());
    suite["analysis"] = plan;
    const Json full = json_of(read_described<AnalysisPlan>(records::completed<AnalysisPlan>(plan), "plan"));
    add_to_manifest({{"suite", suite.dump()}, {"analysis", full}, {"analysis_hash", sha256_hex(canonical_json(full))}});
  }

  static std::string short_id(const std::string& text) {
    std::uint64_t hash = 1469598103934665603u;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    std::string id(16, '0');
    for (std::size_t i = 0; i < 16; ++i) id[15 - i] = "0123456789abcdef"[hash >> (4 * i) & 15];
    return id;
  }

  std::filesystem::path folder_;
};

// A name that tries to escape from text, attributes, scripts and terminals.
inline const std::string kHostile =
    "\"><img src=x onerror=alert(1)></script><script>alert(2)</script>'&{{data}}\x1b[31m";

}  // namespace relign::report
