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

// A scene, noise level or algorithm of the suite.
struct PlanEntry {
  std::string name, plugin, plugin_hash;
  Json identity;

  std::string key() const { return name; }  // unique in its list

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"name"}, s.name...);
    visit(Member{"plugin"}, s.plugin...);
    visit(Member{"plugin_hash"}, s.plugin_hash...);
    visit(Member{"identity", "what makes it this one and no other"}, s.identity...);
  }
};
struct PlanScene : PlanEntry {
  Json data;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    PlanEntry::members(visit, s...);
    visit(Member{"data", "hashes of the scene's data files"}, s.data...);
  }
};
struct PlanMethod : PlanEntry {
  std::string protocol = "paper";

  std::string key() const { return records::method_key(name, protocol); }

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    PlanEntry::members(visit, s...);
    visit(Member{.key = "protocol", .one_of = "paper blind"}, s.protocol...);
  }
};

// The trials of one algorithm on one scene and noise level.
struct PlanBlock {
  std::string scene, noise_level, algorithm, protocol = "paper", ids;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"scene"}, s.scene...);
    visit(Member{"noise_level"}, s.noise_level...);
    visit(Member{"algorithm"}, s.algorithm...);
    visit(Member{.key = "protocol", .one_of = "paper blind"}, s.protocol...);
    visit(Member{.key = "ids", .meaning = "ids of its trials, one after the other", .pattern = "^([0-9a-f]{16})+$"},
          s.ids...);
  }
};

struct FrozenPlan {
  unsigned format = kPlanFormat;
  std::string hash;  // of everything that determines the trials and their shards
  std::string name;  // of the suite
  std::string suite, suite_file, suite_folder;
  unsigned shards = 1;
  bool sandbox = false;
  std::uint64_t trials = 0;
  std::string instance_set;
  records::Program program;
  std::vector<PlanScene> scenes;
  std::vector<PlanEntry> noise_levels;
  std::vector<PlanMethod> algorithms;
  std::vector<PlanBlock> blocks;
  std::filesystem::path file;  // where it was read, not in it

  // To which relative paths of the suite refer.
  std::filesystem::path folder() const;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "format", .meaning = "of the file; readers refuse newer ones", .least = 1, .most = 1},
          s.format...);
    visit(Member{.key = "plan", .meaning = "hash", .pattern = records::kShortHash}, s.hash...);
    visit(Member{"name"}, s.name...);
    visit(Member{"suite", "verbatim"}, s.suite...);
    visit(Member{"suite_file"}, s.suite_file...);
    visit(Member{"suite_folder"}, s.suite_folder...);
    visit(Member{.key = "shards", .meaning = "parts", .least = 1}, s.shards...);
    visit(Member{"sandbox", "made with --sandbox: run refuses to run it without", kLeftOut}, s.sandbox...);
    visit(Member{"trials"}, s.trials...);
    visit(Member{.key = "instance_set", .pattern = records::kShortHash}, s.instance_set...);
    visit(Member{"program"}, s.program...);
    visit(Member{"scenes"}, s.scenes...);
    visit(Member{"noise_levels"}, s.noise_levels...);
    visit(Member{"algorithms"}, s.algorithms...);
    visit(Member{"blocks"}, s.blocks...);
  }
};

// The plan, to be written into a file in `folder`. Throws Error(bad_input) for more shards than instances (summed over
// scenes and noise levels), because the trials of one instance stay together.
FrozenPlan freeze(const PreparedPlan& prepared, unsigned shards, const std::filesystem::path& folder,
                  bool sandbox = false);

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
