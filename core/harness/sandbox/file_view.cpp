#include "sandbox/file_view.h"

#include <fcntl.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

#include "sandbox/failure.h"

namespace relign::sandbox {
namespace {

constexpr const char* kSystemFolders[] = {"/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32"};
// What programs need of the configuration: the loader's, and Debian's choice of libraries (BLAS).
constexpr const char* kSystemFiles[] = {"/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime"};
// Without zero: mapped, it is shared memory that escapes the limit.
constexpr const char* kDevices[] = {"null", "full", "random", "urandom"};
constexpr const char* kMountPoint = "/usr";  // a folder that every system has; covered by the new root

constexpr std::uint64_t kReadOnly = MOUNT_ATTR_RDONLY | MOUNT_ATTR_NOSUID;  // devices can be written nevertheless

bool exists(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0;
}

bool is_folder(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 && S_ISDIR(found.st_mode);
}

bool is_folder(int descriptor) {
  struct stat found {};
  return ::fstat(descriptor, &found) == 0 && S_ISDIR(found.st_mode);
}

// A detached copy of the files below `path`; it can still be mounted when `path` is out of sight.
int copy_of(const std::string& path, std::uint64_t attributes_set) {
  const int tree = ::open_tree(AT_FDCWD, path.c_str(), OPEN_TREE_CLONE | OPEN_TREE_CLOEXEC | AT_RECURSIVE);
  if (tree < 0) refuse("cannot show '" + path + "'");
  mount_attr attributes{};
  attributes.attr_set = attributes_set;
  if (::mount_setattr(tree, "", AT_EMPTY_PATH | AT_RECURSIVE, &attributes, sizeof attributes) != 0)
    refuse("cannot make '" + path + "' read-only");
  return tree;
}

void make_folders(const std::string& path) {
  for (std::size_t end = path.find('/', 1); end != std::string::npos; end = path.find('/', end + 1))
    ::mkdir(path.substr(0, end).c_str(), 0755);
  if (!path.empty()) ::mkdir(path.c_str(), 0755);
}

void make_place(const std::string& path, bool folder) {
  if (exists(path)) return;
  make_folders(folder ? path : path.substr(0, path.rfind('/')));
  if (!folder) ::close(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0444));
}

void write_text(const char* path, const char* text) {
  const int file = ::open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0444);
  if (file < 0 || ::write(file, text, std::strlen(text)) < 0) refuse(std::string("cannot write '") + path + "'");
  ::close(file);
}

void mount_memory(const char* path, const std::string& options) {
  if (::mount("tmpfs", path, "tmpfs", MS_NOSUID | MS_NODEV, options.c_str()) != 0)
    refuse(std::string("cannot mount memory at '") + path + "'");
}

// Processes and nothing else: neither the machine's load nor its settings.
int new_proc() {
  const int made = ::fsopen("proc", FSOPEN_CLOEXEC);
  if (made < 0 || ::fsconfig(made, FSCONFIG_SET_STRING, "subset", "pid", 0) != 0 ||
      ::fsconfig(made, FSCONFIG_CMD_CREATE, nullptr, nullptr, 0) != 0)
    refuse("cannot make a /proc of its own");
  const int mounted =
      ::fsmount(made, FSMOUNT_CLOEXEC, MOUNT_ATTR_NOSUID | MOUNT_ATTR_NODEV | MOUNT_ATTR_NOEXEC | MOUNT_ATTR_RDONLY);
  require(mounted >= 0, "cannot mount a /proc of its own (a container with a masked /proc does not allow it)");
  ::close(made);
  return mounted;
}

void attach(int tree, const std::string& path) {
  if (::move_mount(tree, "", AT_FDCWD, path.c_str(), MOVE_MOUNT_F_EMPTY_PATH) != 0)
    refuse("cannot mount '" + path + "'");
  ::close(tree);
}

void make_read_only(const std::string& path) {
  mount_attr attributes{};
  attributes.attr_set = MOUNT_ATTR_RDONLY;
  if (::mount_setattr(AT_FDCWD, path.c_str(), 0, &attributes, sizeof attributes) != 0)
    refuse("cannot make '" + path + "' read-only");
}

}  // namespace

FileView::FileView(std::vector<Mount> mounts) {
  require(::mount("", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0, "cannot separate its mounts");
  for (const char* folder : kSystemFolders) add(Mount::Kind::read_only, folder);
  for (const char* file : kSystemFiles) add(Mount::Kind::read_only, file);
  for (Mount& mount : mounts) add(mount.kind, mount.path);
  for (const char* device : kDevices) {
    const std::string path = std::string("/dev/") + device;
    devices_.emplace_back(path, copy_of(path, kReadOnly));
  }
  empty_file_ = devices_.front().second;
}

void FileView::add(Mount::Kind kind, const std::string& path) {
  Source source{{kind, path}, -1, ""};
  struct stat found {};
  if (kind == Mount::Kind::read_only) {
    if (::lstat(path.c_str(), &found) != 0) return;
    char target[4096];
    const bool top = path.rfind('/') == 0;  // such as /bin, which is a link to usr/bin
    const ssize_t length = top && S_ISLNK(found.st_mode) ? ::readlink(path.c_str(), target, sizeof target) : -1;
    if (length > 0)
      source.link.assign(target, static_cast<std::size_t>(length));
    else
      source.tree = copy_of(path, kReadOnly | MOUNT_ATTR_NODEV);
  }
  sources_.push_back(std::move(source));
}

void FileView::place(const Mount& mount, int tree) {
  if (mount.kind == Mount::Kind::hidden) {
    if (!exists(mount.path)) return;
    if (is_folder(mount.path)) {
      mount_memory(mount.path.c_str(), "mode=0755,size=64k");
      empty_folders_.push_back(mount.path);
    } else if (::mount("/dev/null", mount.path.c_str(), nullptr, MS_BIND, nullptr) != 0) {
      refuse("cannot hide '" + mount.path + "'");
    }
    return;
  }
  make_place(mount.path, is_folder(tree));
  attach(tree, mount.path);
}

void FileView::make_devices() {
  make_folders("/dev");
  for (const auto& [path, tree] : devices_) {
    make_place(path, false);
    attach(tree, path);
  }
  for (const auto& [target, link] :
       {std::pair{"/proc/self/fd", "/dev/fd"}, std::pair{"/proc/self/fd/0", "/dev/stdin"},
        std::pair{"/proc/self/fd/1", "/dev/stdout"}, std::pair{"/proc/self/fd/2", "/dev/stderr"}})
    require(::symlink(target, link) == 0, "cannot fill /dev");
}

void FileView::enter(std::size_t disk_bytes) {
  const int proc = new_proc();  // while the system's own is in sight: the kernel asks for one
  mount_memory(kMountPoint, "mode=0755,size=1m");
  require(::chdir(kMountPoint) == 0 && ::syscall(SYS_pivot_root, ".", ".") == 0 && ::umount2(".", MNT_DETACH) == 0 &&
              ::chdir("/") == 0,
          "cannot replace the root folder");
  empty_folders_.push_back("/");
  make_folders("/proc");
  attach(proc, "/proc");
  make_devices();
  make_folders("/tmp");
  // One limit for files and shared memory.
  mount_memory("/tmp", "mode=1777,nr_inodes=16k,size=" + std::to_string(disk_bytes));
  make_folders("/dev/shm");
  require(::mount("/tmp", "/dev/shm", nullptr, MS_BIND, nullptr) == 0, "cannot mount /dev/shm");
  make_folders("/etc");
  write_text("/etc/passwd", "plugin:x:1000:1000:plugin:/tmp:/bin/sh\n");
  write_text("/etc/group", "plugin:x:1000:\n");
  for (const Source& source : sources_) {
    if (!source.link.empty())
      require(::symlink(source.link.c_str(), source.mount.path.c_str()) == 0, "cannot link a system folder");
    else
      place(source.mount, source.tree);
  }
  for (const std::string& folder : empty_folders_) make_read_only(folder);
}

}  // namespace relign::sandbox
