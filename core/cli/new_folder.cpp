#include "cli/new_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>

#include "base/error.h"
#include "base/files.h"

namespace relign::cli {
namespace fs = std::filesystem;

NewFolder::NewFolder(const fs::path& folder) {
  // A trailing slash leaves an empty file name.
  folder_ = fs::absolute(folder).lexically_normal();
  if (!folder_.has_filename()) folder_ = folder_.parent_path();
  if (fs::exists(fs::symlink_status(folder_)))
    throw Error(ErrorKind::bad_input, "'" + folder_.string() + "' already exists; nothing was written");
  std::error_code error;
  fs::create_directories(folder_.parent_path(), error);
  std::string pattern = (folder_.parent_path() / ".relign-new-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr)
    throw Error(ErrorKind::io, "cannot write to '" + folder_.parent_path().string() + "': " + std::strerror(errno));
  draft_ = pattern;
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  fs::remove_all(draft_, ignored);
}

fs::path NewFolder::write(const NewFiles& files) {
  // One level down, because mkdtemp creates its folder with mode 0700.
  fs::path inner = draft_ / "new";
  for (const auto& [path, content] : files) write_file_atomically(inner / path, content);
  return inner;
}

void NewFolder::keep() {
  std::error_code error;
  fs::rename(draft_ / "new", folder_, error);
  if (error) throw Error(ErrorKind::io, "cannot create '" + folder_.string() + "': " + error.message());
}

}  // namespace relign::cli
