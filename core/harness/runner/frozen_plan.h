// A plan in a file: the list of trials and all that decides them, frozen, so that many machines run parts of the same
// list. What the file says is made again from the suite and compared: a plugin or a data file that changed in between
// is an error with a word, never half a study with one version and half with another.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "runner/run.h"

namespace relign::runner {

inline constexpr int kPlanFormat = 1;  // "format" of a plan file

struct FrozenPlan {
  std::filesystem::path file;
  Json content;         // as in the file
  std::string hash;     // of what decides the trials and their parts
  std::string name;     // of the suite
  unsigned shards = 1;  // how many parts
  std::size_t trials = 0;
  // The suite, verbatim, and the folder that its relative paths are below.
  std::string suite_text, suite_file;
  std::filesystem::path suite_folder;
};

// The content of a plan file that will lie in `folder`. Throws Error(bad_input) for more shards than instances, counted
// over scenes and noise levels: the trials of one instance stay together.
Json freeze(const PreparedPlan& prepared, unsigned shards, const std::filesystem::path& folder);

// Throws Error: io; bad_input for a file that is no plan, damaged, or of a newer format.
FrozenPlan read_plan(const std::filesystem::path& file);

// Throws Error(bad_input) with everything that changed between the plan and `prepared`, made from its suite now.
void check_unchanged(const FrozenPlan& frozen, const PreparedPlan& prepared);

// Places in the plan that belong to part `shard` (from 0) of `shards`. Instances are dealt out in turn, so that every
// part has its share of every scene and noise level, and all algorithms of an instance are in one part.
std::vector<std::size_t> places_of_shard(const suites::Plan& plan, unsigned shard, unsigned shards);

// The same part's ids, read from the file alone: without suite and plugins, on any machine.
std::vector<std::string> ids_of_shard(const FrozenPlan& plan, unsigned shard);

}  // namespace relign::runner
