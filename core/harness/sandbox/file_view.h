// The files that a process in a sandbox sees: a new root with the system's programs and libraries, what it was granted,
// all read-only, and an empty /tmp. Mounts of the new interface (open_tree, move_mount), Linux 5.12 or later.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace relign::sandbox {

struct Mount {
  enum class Kind { read_only, hidden } kind;  // hidden: an empty folder or file in its place
  std::string path;
};

class FileView {
 public:
  // Opens what will be mounted, in a user and mount namespace of its own. Ends the program when it cannot.
  explicit FileView(std::vector<Mount> mounts);
  // Replaces the root. The caller is process 1 of its own process namespace.
  void enter(std::size_t disk_bytes);

 private:
  void add(Mount::Kind kind, const std::string& path);
  void place(const Mount& mount, int tree);
  void make_devices();

  struct Source {
    Mount mount;
    int tree = -1;     // a detached copy; -1 for a hidden path
    std::string link;  // a symbolic link to create instead
  };
  std::vector<Source> sources_;
  std::vector<std::pair<std::string, int>> devices_;
  std::vector<std::string> empty_folders_;  // to be made read-only
  int empty_file_ = -1;
};

}  // namespace relign::sandbox
