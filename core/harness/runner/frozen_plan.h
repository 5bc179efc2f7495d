// A plan in a file: the list of trials and everything that determines them, so that several machines can run shards of
// the same list. Before each shard the plan is made again from the suite and compared with the file: a plugin or data
// file that changed meanwhile is an error, so that no study mixes versions.
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
  std::string hash;     // of everything that determines the trials and their shards
  std::string name;     // of the suite
  unsigned shards = 1;  // number of shards
  std::size_t trials = 0;
  bool sandbox = false;  // made with --sandbox: its algorithms run in a sandbox only
  // The suite, verbatim, and the folder to which its relative paths refer.
  std::string suite_text, suite_file;
  std::filesystem::path suite_folder;
};

// The content of a plan file in `folder`. Throws Error(bad_input) for more shards than instances (summed over scenes
// and noise levels), because the trials of one instance stay together.
Json freeze(const PreparedPlan& prepared, unsigned shards, const std::filesystem::path& folder, bool sandbox = false);

// Throws Error(io), and Error(bad_input) for a file that is not a plan, damaged, or of a newer format.
FrozenPlan read_plan(const std::filesystem::path& file);

// Throws Error(bad_input) that lists every change between the plan and `prepared`, made from its suite now.
void check_unchanged(const FrozenPlan& frozen, const PreparedPlan& prepared);

// Positions in the plan of shard `shard` (from 0) of `shards`. Instances are dealt out in turn, so that every
// shard has its share of every scene and noise level, and all algorithms of an instance are in one shard.
std::vector<std::size_t> places_of_shard(const suites::Plan& plan, unsigned shard, unsigned shards);

// The ids of the same shard, from the file only: without suite and plugins, on any machine.
std::vector<std::string> ids_of_shard(const FrozenPlan& plan, unsigned shard);

}  // namespace relign::runner
