// A suite: what a user wants compared. Read from JSON (see results and suites in docs), every
// mistake at once with its place; unknown keys are errors.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "base/shared_keys.h"
#include "plugin_host/catalog.h"

namespace relign::suites {

struct SceneEntry {
  std::string name;  // shown in tables; file stem of a path, else the id
  plugin_host::Choice choice;
};

struct LevelEntry {
  std::string name;
  plugin_host::Choice choice;
};

// Of a suite's entry with "trainings" there is one of these for each of its model files.
struct AlgorithmEntry {
  std::string name;  // of a list of trainings "METHOD (TRAINING)"
  plugin_host::Choice choice;
  std::string protocol;          // "paper" or "blind"
  std::string merit;             // empty: the protocol's own
  unsigned steps = 50;           // budget after step 0
  bool added = false;            // home or random, added by us
  std::string method, training;  // of a list of trainings the entry's name and the model's; else empty
};

// What was decided before the run about how its results are judged; null where nothing was. Members as in the suite file
// (docs/suites.md), defaults filled in: {"primary", "rule", "contrasts", "smallest_relevant_ratio", "yield"}.
Json analysis_json(const Json& written);

// What was given, by the names of the suite file.
Json machine_time_json(const MachineTimeKeys& times);

struct Suite {
  std::string name;  // "name" of the file, else its stem
  std::string file;  // as given
  std::string text;  // verbatim, for the results
  std::uint64_t seed = 1;
  unsigned instances = 100;
  unsigned first_instance = 0;
  std::string limits = "soft";  // or "hard"
  std::vector<SceneEntry> scenes;
  std::vector<LevelEntry> levels;
  std::vector<AlgorithmEntry> algorithms;
  double trial_seconds = 3600;   // a trial that takes longer is ended
  unsigned trial_memory_mb = 0;  // of its worker; 0: four fifths of the machine's
  MachineTimeKeys machine_time;  // what is absent stays the scene's
  Json spec;                     // null when absent
  Json analysis;                 // analysis_json, null when absent
  // RMSE levels whose arrival is counted, falling; empty: the statistics' own.
  std::vector<double> targets;
};

// Throws Error(bad_input) listing every problem. Adds home and random when they are missing.
Suite read_suite(const std::filesystem::path& file, plugin_host::Catalog& catalog);
Suite read_suite(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog);

}  // namespace relign::suites
