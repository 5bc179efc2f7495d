#include "base/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"

namespace relign {
namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const char* what, const fs::path& path, int code) {
  throw Error(ErrorKind::io, std::string(what) + " '" + path.string() + "': " + std::strerror(code));
}

std::string megabytes(std::size_t bytes) {
  return bytes >> 20U > 0 ? std::to_string(bytes >> 20U) + " MB" : std::to_string(bytes) + " bytes";
}

constexpr std::size_t kBufferBytes = 1 << 16;

// Temporary names are the file's name and this mark; on file systems without O_TMPFILE, six letters more.
constexpr std::string_view kTemporaryMark = ".relign-tmp";
constexpr int kMostAttempts = 100;

}  // namespace

void throw_cannot_write(const fs::path& path, const std::error_code& code) {
  throw Error(ErrorKind::io, "cannot write '" + path.string() + "': " + code.message());
}

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
  const fs::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) fail("cannot create the folder for", path_, code.value());
  // A file without a name vanishes with its process. commit() gives it one through /proc.
  if (::access("/proc/self/fd", X_OK) == 0)
    descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (descriptor_ >= 0) return;
  temporary_ = path_.string() + std::string(kTemporaryMark) + "-XXXXXX";
  descriptor_ = ::mkostemp(temporary_.data(), O_CLOEXEC);
  if (descriptor_ < 0) fail("cannot write", path_, errno);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::write(std::string_view piece) {
  buffer_ += piece;
  if (buffer_.size() >= kBufferBytes) flush();
}

void AtomicFile::flush() {
  for (std::string_view rest = buffer_; !rest.empty();) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("cannot write", path_, errno);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
}

// A link cannot replace a file: where there is one, the new file gets a temporary name, which rename() moves. A killed
// process may have left that name, or another one uses it at this moment: then the other writer's file is removed, or
// moved by this rename(), which is as if the other one had been first or last.
void AtomicFile::name_file() {
  const std::string unnamed = "/proc/self/fd/" + std::to_string(descriptor_);
  const std::string temporary = path_.string() + std::string(kTemporaryMark);
  const auto link_as = [&](const std::string& name) {
    if (::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) return true;
    if (errno != EEXIST) fail("cannot write", path_, errno);
    return false;
  };
  if (link_as(path_)) return;
  int attempts = 0;
  while (!link_as(temporary)) {
    ::unlink(temporary.c_str());
    if (++attempts == kMostAttempts) fail("cannot write", path_, EEXIST);
  }
  if (::rename(temporary.c_str(), path_.c_str()) == 0 || errno == ENOENT) return;
  const int reason = errno;
  ::unlink(temporary.c_str());
  fail("cannot write", path_, reason);
}

void AtomicFile::commit() {
  flush();
  if (::fsync(descriptor_) != 0 || ::fchmod(descriptor_, 0644) != 0) fail("cannot write", path_, errno);
  if (temporary_.empty()) name_file();
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0 || (!temporary_.empty() && ::rename(temporary_.c_str(), path_.c_str()) != 0))
    fail("cannot write", path_, errno);
  temporary_.clear();
}

bool is_temporary_file(const fs::path& path) {
  const std::string name = path.filename().string();
  const std::size_t mark = name.rfind(kTemporaryMark), end = mark + kTemporaryMark.size();
  return mark != std::string::npos && mark > 0 && (name.size() == end || (name.size() == end + 7 && name[end] == '-'));
}

void remove_temporary_files(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code code;
  for (fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, code), end;
       !code && entry != end; entry.increment(code))
    if (is_temporary_file(entry->path()) && fs::is_regular_file(entry->symlink_status(code))) found.push_back(*entry);
  for (const fs::path& file : found) fs::remove(file, code);
}

std::string read_file(const fs::path& path, std::size_t most) {
  std::error_code code;
  if (fs::is_directory(path, code)) throw Error(ErrorKind::io, "cannot read '" + path.string() + "': it is a folder");
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) fail("cannot read", path, errno);
  std::string content;
  char buffer[1 << 16];
  while (true) {
    const ssize_t got = ::read(descriptor, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      const int reason = errno;
      ::close(descriptor);
      fail("cannot read", path, reason);
    }
    if (got == 0) break;
    content.append(buffer, static_cast<std::size_t>(got));
    if (content.size() > most) {
      ::close(descriptor);
      throw Error(ErrorKind::bad_input, path.string() + ": the file is larger than " + megabytes(most) +
                                            ", the most that is read; is it the intended file?");
    }
  }
  ::close(descriptor);
  return content;
}

void write_file_atomically(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

fs::path cache_folder() {
  fs::path base;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg)
    base = xdg;
  else if (const char* home = std::getenv("HOME"); home && *home)
    base = fs::path(home) / ".cache";
  else
    return {};
  const fs::path folder = fs::absolute(base) / "relign-bench";
  std::error_code code;
  fs::create_directories(folder, code);
  if (code || ::access(folder.c_str(), W_OK) != 0) return {};
  return folder;
}

fs::path program_on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const fs::path file = fs::path(folder) / name; !folder.empty() && ::access(file.c_str(), X_OK) == 0)
      return file;
  return {};
}

}  // namespace relign
