// Index of a merge: the file, bytes and position in the merged plan of every trial. Entries are small and without
// strings, since there may be a million. Internal to this module.
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

// Position in a plan, ordered by scene, noise level, algorithm, instance. A planned trial without a record is known by
// its id only: it takes the position of the last trial before it that has a record, and `after` counts on from there.
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
  // Adds the trials that the manifest's order names: complete ones to `trials`, the others, damaged ones among them, to
  // `missing`. Throws Error.
  void add(const std::filesystem::path& folder, const std::vector<PackedId>& order, const ManifestJoin& manifests,
           MergeSummary& summary);

  std::vector<FoundTrial> trials;
  std::vector<FoundTimes> times;
  std::vector<MissingTrial> missing;
  std::vector<Damage> damaged;
  std::vector<std::filesystem::path> files;
  std::vector<std::filesystem::path> sources;

 private:
  std::uint32_t add_file(const std::filesystem::path& file);
};

// Reads blocks from many files, with a limited number of them open at a time.
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

// Keeps one record of each trial in `index.trials`, in the plan's order: a finished one before a failed one, then that
// of the folder given first. Compares the others with it.
void resolve_duplicates(MergeIndex& index, const ManifestJoin& manifests, MergeSummary& summary);

}  // namespace relign::records
