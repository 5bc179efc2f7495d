// The manifests of a merge: checks that they belong together, and joins them into one. Internal to this module.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "records/manifest.h"

namespace relign::records {

class ManifestJoin {
 public:
  // Throws Error(bad_input) naming the differences from the first one. Ignores its order.
  void add(const std::filesystem::path& folder, const Manifest& manifest);

  // Positions by display names; -1 when no manifest has it.
  int scene(const std::string& name) const { return place_of(scenes_, name); }
  int level(const std::string& name) const { return place_of(levels_, name); }
  int algorithm(const std::string& name, const std::string& protocol) const;

  // Whether one of these plugins is reproducible only on one processor, and the folders are from several.
  bool may_differ_by_cpu(const std::string& scene, const std::string& level, const std::string& algorithm) const;

  // Shards of the plan that all folders share; 0 if there is none.
  unsigned shards() const;
  std::vector<unsigned> missing_shards() const;

  // Messages on differences that do not prevent a merge: programs, processors, plugins. `joined`: the merged manifest.
  std::vector<std::string> notes(const Manifest& joined) const;
  std::size_t sandboxed_sources() const;  // whose algorithms ran in a sandbox

  // The merged manifest with an empty list `order`; taken[i]: trials from the i-th folder added.
  Manifest joined(const std::vector<std::size_t>& taken) const;

 private:
  using Names = std::vector<std::string>;
  static int place_of(const Names& names, const std::string& name);
  static constexpr auto kNoSource = static_cast<std::size_t>(-1);
  void join_lists(const std::filesystem::path& folder, const Manifest& manifest);
  void add_source(const std::filesystem::path& folder, const Manifest& manifest);
  void count(const MergeSource& source);
  std::size_t suite_number(const StoredSuite& suite);

  std::filesystem::path first_folder_;
  std::optional<Manifest> first_;       // of the first folder; its lists grow
  Names scenes_, levels_, algorithms_;  // algorithms: name and protocol
  std::vector<StoredSuite> suites_;
  std::vector<MergeSource> sources_;
  std::vector<std::size_t> own_source_;  // per folder added: its place in sources_; of a merged one: kNoSource
  std::vector<Machine> processors_;      // of sources, one of each kind of processor
  std::map<std::string, std::size_t> cpus_, flags_;
  std::map<std::string, std::set<std::string>> plugins_;   // name -> hashes
  std::vector<std::string> other_specs_, other_analyses_;  // folders
  std::set<std::string> this_cpu_;                         // names
};

}  // namespace relign::records
