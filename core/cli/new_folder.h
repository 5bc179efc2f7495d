// Creates a folder of files atomically: all files or none.
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
  // Throws Error: bad_input if the folder exists, io.
  explicit NewFolder(const std::filesystem::path& folder);
  ~NewFolder();  // removes a draft that was not kept
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  // Writes to a draft beside the folder and returns the draft, so that the files can be checked. Throws Error(io).
  std::filesystem::path write(const NewFiles& files);
  // Renames the draft to the folder. Throws Error(io).
  void keep();

 private:
  std::filesystem::path folder_, draft_;
};

}  // namespace relign::cli
