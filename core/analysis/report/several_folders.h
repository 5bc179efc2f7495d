// Several results folders on one page. Folders with the same instance set are merged, by merge's own rules, and
// compared as one; what was run on other instances stands in groups of its own, under its folder's name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "report/pictures.h"

namespace relign::report {

// Folders that are one instance set, in the order given.
struct FolderSet {
  std::string label;                           // "quick", "quick and more", or the path where names are not enough
  std::vector<std::filesystem::path> folders;  // at least one
};

// Throws Error as load_results does.
std::vector<FolderSet> folder_sets(const std::vector<std::filesystem::path>& folders);

// A folder below the system's temporary one that goes with this object.
class TemporaryFolder {
 public:
  TemporaryFolder();  // throws Error(io)
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// The page data of all sets as those of one page: groups and scenes get their set's label. `parts` tells for each set
// where it comes from: {label, command, suite_name, suite_file, suite_text, seed, instance_set, program, machine,
// sources, merge, merge_notes}. Throws Error(bad_input) where one name means two methods.
Json joined_data(const std::vector<FolderSet>& sets, std::vector<Json> data);

// Adds a set's pictures to those of a page.
void add_gallery(Gallery& all, Gallery one, const std::string& label);

}  // namespace relign::report
