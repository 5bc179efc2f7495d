// A suite: the scenes, noise levels and algorithms that a user wants to compare. Read from JSON (docs/suites.md); all
// mistakes are reported at once with their positions, and unknown keys are errors.
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
  std::string name;  // display name; default: file stem of a path, else the id
  plugin_host::Choice choice;
};

struct LevelEntry {
  std::string name;
  plugin_host::Choice choice;
};

// An entry with "trainings" in the suite becomes one of these for each of its model files.
struct AlgorithmEntry {
  std::string name;  // for a list of trainings "METHOD (TRAINING)"
  plugin_host::Choice choice;
  std::string protocol;          // "paper" or "blind"
  std::string merit;             // empty: the protocol's default
  unsigned steps = 50;           // budget after step 0
  bool added = false;            // home or random, added automatically
  std::string method, training;  // for a list of trainings: the entry's name and the model's; else empty
};

// What every draw of a suite follows from.
struct Seeds {
  std::uint64_t instances = 1, algorithms = 1;
};

struct Suite {
  std::string name;  // "name" in the file, else its stem
  std::string file;  // as given
  std::string text;  // verbatim, for the results
  std::uint64_t seed = kDefaultSeed;
  std::string commitment;      // of a sealed suite (secret.h), else empty
  std::optional<Seeds> seeds;  // of a sealed suite whose secret is known
  unsigned instances = kDefaultInstances;
  unsigned first_instance = kDefaultFirstInstance;
  std::string limits = kDefaultLimits;  // "soft" or "hard"
  std::vector<SceneEntry> scenes;
  std::vector<LevelEntry> levels;
  std::vector<AlgorithmEntry> algorithms;
  double trial_seconds = 3600;   // time limit of a trial
  unsigned trial_memory_mb = 0;  // memory limit of its worker; 0: four fifths of the machine's memory
  MachineTimeKeys machine_time;  // absent members keep the scene's values
  std::optional<CycleTimes> cycle;
  std::optional<Prices> cost;
  Json spec;  // null when absent
  std::optional<AnalysisPlan> analysis;
  // RMSE targets in descending order; empty: the default of the statistics.
  std::vector<double> targets;

  // While the secret of a sealed suite is unknown, instances that it does not evaluate.
  Seeds draw_seeds() const { return seeds.value_or(Seeds{seed, seed}); }

  // What identifies the draws: the commitment or the seed.
  Json seed_json() const { return commitment.empty() ? Json(seed) : Json(commitment); }
};

// Throws Error(bad_input) that lists every mistake. Adds home and random when they are missing.
Suite read_suite(const std::filesystem::path& file, plugin_host::Catalog& catalog);
Suite read_suite(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog);

}  // namespace relign::suites
