// A new folder of files, written whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace relign::cli {

// Path inside the folder and content of every file.
using NewFiles = std::vector<std::pair<std::filesystem::path, std::string>>;

class NewFolder {
 public:
  // Throws Error(bad_input) when the folder exists already.
  explicit NewFolder(const std::filesystem::path& folder);
  ~NewFolder();  // what was not kept is removed
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  // Writes into a draft beside the folder, which is returned for a last look. Throws Error(io).
  std::filesystem::path write(const NewFiles& files);
  // The draft becomes the folder. Throws Error(io).
  void keep();

 private:
  std::filesystem::path folder_, draft_;
};

}  // namespace relign::cli
