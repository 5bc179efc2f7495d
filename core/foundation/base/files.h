// Whole-file reading and writing with errors that name the file and the reason.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace relign {

inline constexpr std::size_t kMostFileBytes = std::size_t{1} << 30;

// The file's bytes. Throws Error: io with the path and the system's reason; bad_input when there are more than `most`,
// of which no more are read: what a stranger's file names may be a device without end.
std::string read_file(const std::filesystem::path& path, std::size_t most = kMostFileBytes);

// A file written piece by piece into a temporary file in the same folder; commit() flushes it to the disk and renames
// it. Without commit nothing is left of it. Creates missing folders. Throws Error(io).
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  void write(std::string_view piece);
  void commit();

 private:
  void flush();
  std::filesystem::path path_;
  std::string temporary_, waiting_;
  int descriptor_ = -1;
};

// Writes into a temporary file in the same folder, flushes it to the disk and renames it: readers
// see the old file or the whole new one. Creates missing folders. Throws Error(io).
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

// The user's cache folder for this program (XDG_CACHE_HOME or ~/.cache, plus "relign-bench"),
// created if need be; empty when there is none that can be written.
std::filesystem::path cache_folder();

}  // namespace relign
