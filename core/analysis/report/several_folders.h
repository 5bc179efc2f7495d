// Several results folders on one page. Folders with the same instance set are merged by the rules of records::merge and
// compared as one; others have groups of their own, labelled with the folder's name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/page_model.h"
#include "report/pictures.h"

namespace relign::report {

// Folders with the same instance set, in the given order.
struct FolderSet {
  std::string label;                           // "quick", "quick and 1 more", or the path if names are not unique
  std::vector<std::filesystem::path> folders;  // at least one
};

// Throws Error as load_results does.
std::vector<FolderSet> folder_sets(const std::vector<std::filesystem::path>& folders);

// A temporary folder, removed with this object.
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

// Joins the pages of all sets: groups and scenes get the label of their set, and `parts` has the provenance of each.
// Throws Error (bad_input) if one name denotes different methods, or if smallest relevant ratios differ.
PageModel joined_page(const std::vector<FolderSet>& sets, std::vector<PageModel> pages);

// Adds a set's pictures to those of a page.
void add_gallery(Gallery& all, Gallery one, const std::string& label);

}  // namespace relign::report
