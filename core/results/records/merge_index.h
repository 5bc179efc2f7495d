// Where every trial of a merge lies, by its place in the merged plan. Small and without texts: there may be a million.
// Used inside this room.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "records/line_files.h"
#include "records/merge.h"
#include "records/merge_manifest.h"

namespace relign::records {

// A trial's id, at most 16 characters, the rest zeros.
using PackedId = std::array<char, 16>;
PackedId packed(const std::string& id, const std::string& place);  // throws Error(bad_input) for a longer one
std::string unpacked(const PackedId& id);

// The order of a plan: scene, noise level, algorithm, instance. `after` counts planned trials without a record behind
// the last one that has one: nobody knows what they are.
struct PlanPlace {
  std::uint32_t scene = 0, level = 0, algorithm = 0, after = 0;
  std::uint64_t instance = 0;
  bool operator<(const PlanPlace& other) const;
  bool same_trial(const PlanPlace& other) const;
};

struct FoundTrial {
  PackedId id{};
  PlanPlace place;
  std::uint32_t source = 0, file = 0;
  BlockPlace block;
  bool ended_well = false;
};

struct FoundTimes {
  PackedId id{};
  std::uint32_t source = 0, file = 0;
  BlockPlace block;
};

struct MissingTrial {
  PackedId id{};
  PlanPlace place;
};

class MergeIndex {
 public:
  // All complete trials that the manifest's order names, and those that it names and are nowhere. Throws Error.
  void add(const std::filesystem::path& folder, const std::vector<PackedId>& order, const ManifestJoin& manifests,
           MergeSummary& summary);

  std::vector<FoundTrial> trials;
  std::vector<FoundTimes> times;
  std::vector<MissingTrial> missing;
  std::vector<std::filesystem::path> files;
  std::vector<std::filesystem::path> sources;

 private:
  std::uint32_t add_file(const std::filesystem::path& file);
};

// Bytes of places in many files; few of them are open at a time.
class BlockReader {
 public:
  explicit BlockReader(const std::vector<std::filesystem::path>& files) : files_(files), open_(files.size(), -1) {}
  ~BlockReader();
  BlockReader(const BlockReader&) = delete;
  BlockReader& operator=(const BlockReader&) = delete;
  const std::string& read(std::uint32_t file, const BlockPlace& place);  // valid until the next read; throws Error(io)
  TrialRecord record(std::uint32_t file, const BlockPlace& place);

 private:
  const std::vector<std::filesystem::path>& files_;
  std::vector<int> open_;
  std::vector<std::uint32_t> opened_;  // oldest first
  std::string text_;
};

// Leaves one record of each trial in `index.trials`, in the plan's order: what came to its end before what did not,
// then the folder that was given first. Compares the others with it.
void settle_duplicates(MergeIndex& index, const ManifestJoin& manifests, MergeSummary& summary);

}  // namespace relign::records
