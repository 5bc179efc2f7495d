#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <memory>
#include <set>

#include "base/error.h"
#include "base/text.h"
#include "plugin_host/process_child.h"
#include "submissions/archive.h"

namespace relign::submissions {
namespace fs = std::filesystem;

namespace {

struct CloseReader {
  void operator()(struct archive* reader) const { archive_read_free(reader); }
};

std::string shown(const std::string& path) {
  constexpr std::size_t kLongest = 100;
  std::string text = printable(path.size() <= kLongest ? path : path.substr(0, kLongest) + "...");
  std::replace_if(
      text.begin(), text.end(), [](char letter) { return letter == '\n' || letter == '\t'; }, '?');  // one line
  return text;
}

std::string at_most(std::uint64_t count, const char* unit) {
  return "; at most " + std::to_string(count) + " " + unit + " are allowed";
}

// What an entry is, if it is neither a file nor a folder.
const char* forbidden_kind(struct archive_entry* entry) {
  if (archive_entry_hardlink(entry) != nullptr) return "a hard link";
  switch (archive_entry_filetype(entry)) {
    case AE_IFREG:
      return archive_entry_sparse_count(entry) > 0 ? "a sparse file" : nullptr;
    case AE_IFDIR:
      return nullptr;
    case AE_IFLNK:
      return "a symbolic link";
    case AE_IFCHR:
    case AE_IFBLK:
      return "a device";
    case AE_IFIFO:
      return "a named pipe";
    case AE_IFSOCK:
      return "a socket";
    default:
      return "of an unknown kind";
  }
}

class Unpacking {
 public:
  Unpacking(const fs::path& archive, const fs::path& folder, const ArchiveLimits& limits)
      : archive_(archive), folder_(folder), limits_(limits), reader_(archive_read_new()) {
    std::error_code error;
    if (!fs::is_regular_file(archive, error))
      throw Error(ErrorKind::io, "'" + archive.string() + "' is not a file; expected the archive of a submission");
    if (const std::uintmax_t size = fs::file_size(archive, error); size > limits.archive_bytes)
      refuse("it has " + std::to_string(size) + " bytes" + at_most(limits.archive_bytes, "bytes"));
    struct archive* reader = reader_.get();
    archive_read_support_format_tar(reader);
    archive_read_support_filter_gzip(reader);
    archive_read_support_filter_zstd(reader);
    constexpr std::size_t kBlock = 65536;
    if (archive_read_open_filename(reader, archive.c_str(), kBlock) != ARCHIVE_OK) refuse_damaged("");
  }

  void run() {
    struct archive_entry* entry = nullptr;
    for (;;) {
      const int status = archive_read_next_header(reader_.get(), &entry);
      if (status == ARCHIVE_EOF) break;
      if (status != ARCHIVE_OK) refuse_damaged(last_);
      if (++entries_ > limits_.entries)
        refuse("it has more than " + std::to_string(limits_.entries) + " entries" +
               at_most(limits_.entries, "entries"));
      take(entry);
    }
    if (entries_ == 0) refuse("it is empty; expected the files of a submission");
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw Error(ErrorKind::bad_input, "archive '" + archive_.string() + "' is refused: " + why);
  }
  [[noreturn]] void refuse_entry(const std::string& why) const { refuse("entry '" + shown(last_) + "': " + why); }
  [[noreturn]] void refuse_damaged(const std::string& after) const {
    refuse((after.empty() ? std::string() : "after entry '" + shown(after) + "': ") + "it is damaged, or not a tar " +
           "archive, plain or compressed with gzip or Zstandard");
  }

  void take(struct archive_entry* entry) {
    const char* name = archive_entry_pathname(entry);
    last_ = name != nullptr ? name : "";
    const bool folder = archive_entry_filetype(entry) == AE_IFDIR;
    if (folder)  // tar writes folders with a slash at the end, and the folder itself as "./"
      while (last_.size() > 1 && last_.back() == '/') last_.pop_back();
    if (name == nullptr) refuse("an entry has a name that is not text; names must be UTF-8");
    if (const char* kind = forbidden_kind(entry))
      refuse_entry(std::string("it is ") + kind + "; only files and folders are allowed");
    if (const std::string mistake = path_mistake(last_, limits_); !mistake.empty()) refuse_entry(mistake);
    refuse_other_case();
    if (!(folder ? folders_.insert(last_).second : files_.insert(last_).second) ||
        (folder ? files_ : folders_).count(last_) != 0)
      refuse_entry("it occurs twice; each path is allowed once");
    make_parents();
    if (folder)
      make_folder(last_);
    else
      write_file(entry);
  }

  // Paths that some file systems take for one, folders on the way included.
  void refuse_other_case() {
    for (std::size_t end = last_.find('/');; end = last_.find('/', end + 1)) {
      const std::string path = last_.substr(0, end);
      std::string lower = path;
      for (char& letter : lower)
        if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
      const std::string& first = spellings_.emplace(lower, path).first->second;
      if (first != path) refuse_entry("it differs from '" + shown(first) + "' in upper and lower case only");
      if (end == std::string::npos) return;
    }
  }

  void make_parents() {
    for (std::size_t slash = last_.find('/'); slash != std::string::npos; slash = last_.find('/', slash + 1)) {
      const std::string parent = last_.substr(0, slash);
      if (files_.count(parent) != 0) refuse_entry("'" + shown(parent) + "' is both a file and a folder");
      make_folder(parent);
    }
  }

  void make_folder(const std::string& path) {
    if (mkdir((folder_ / path).c_str(), 0755) != 0 && errno != EEXIST) fail(path);
  }

  void write_file(struct archive_entry* entry) {
    const fs::path path = folder_ / last_;
    const mode_t mode = (archive_entry_perm(entry) & S_IXUSR) != 0 ? 0755 : 0644;
    const plugin_host::Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
    if (file.get() < 0 && errno == EEXIST) refuse_entry("it occurs twice; each path is allowed once");
    if (file.get() < 0) fail(last_);
    std::array<char, 65536> piece{};
    std::uint64_t size = 0;
    for (;;) {
      const la_ssize_t got = archive_read_data(reader_.get(), piece.data(), piece.size());
      if (got == 0) break;
      if (got < 0) refuse_damaged(last_);
      size += static_cast<std::uint64_t>(got);
      total_ += static_cast<std::uint64_t>(got);
      if (size > limits_.file_bytes)
        refuse_entry("it unpacks to more than " + std::to_string(limits_.file_bytes) + " bytes" +
                     at_most(limits_.file_bytes, "bytes a file"));
      if (total_ > limits_.total_bytes)
        refuse_entry("with it the archive unpacks to more than " + std::to_string(limits_.total_bytes) + " bytes" +
                     at_most(limits_.total_bytes, "bytes together"));
      for (la_ssize_t done = 0; done < got;) {
        const ssize_t written = write(file.get(), piece.data() + done, static_cast<std::size_t>(got - done));
        if (written < 0 && errno != EINTR) fail(last_);
        if (written > 0) done += written;
      }
    }
  }

  [[noreturn]] void fail(const std::string& path) const {
    throw Error(ErrorKind::io, "cannot write '" + (folder_ / path).string() + "': " + std::strerror(errno));
  }

  const fs::path &archive_, &folder_;
  const ArchiveLimits& limits_;
  std::unique_ptr<struct archive, CloseReader> reader_;
  std::size_t entries_ = 0;
  std::uint64_t total_ = 0;
  std::set<std::string> files_, folders_;
  std::map<std::string, std::string> spellings_;  // by the path in lower case
  std::string last_;                              // path of the entry under way
};

}  // namespace

void unpack_archive(const fs::path& archive, const fs::path& folder, const ArchiveLimits& limits) {
  Unpacking unpacking(archive, folder, limits);
  if (mkdir(folder.c_str(), 0755) != 0)
    throw Error(ErrorKind::io, "cannot create '" + folder.string() + "': " + std::strerror(errno));
  try {
    unpacking.run();
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    throw;
  }
}

}  // namespace relign::submissions
