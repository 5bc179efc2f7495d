// Reads and writes whole files; errors name the file and the system's reason.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

namespace relign {

inline constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;

// The file's bytes. Throws Error: io if unreadable; bad_input if there are more than `most` bytes, of which no more are
// read, because an untrusted file may name an endless device.
std::string read_file(const std::filesystem::path& path, std::size_t most = kMaxFileBytes);

// Throws Error(io): cannot write 'path': reason.
[[noreturn]] void throw_cannot_write(const std::filesystem::path& path, const std::error_code& code);

// Writes a file piece by piece to a file without a name in the same folder; commit() flushes it to disk and names it.
// Without commit() nothing remains. Creates missing folders. Throws Error(io).
//
// SIGKILL leaves a temporary file (see below) if it interrupts commit() while that replaces an existing file, until the
// file is written again; and, on file systems without O_TMPFILE (NFS), at any time before.
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
  void name_file();
  std::filesystem::path path_;
  std::string temporary_, buffer_;  // the temporary name, if it has one
  int descriptor_ = -1;
};

// AtomicFile in one call: readers see either the old file or the complete new one. Throws Error(io).
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

// Whether an interrupted AtomicFile may have left this file, by its name: NAME.relign-tmp or NAME.relign-tmp-XXXXXX.
bool is_temporary_file(const std::filesystem::path& path);

// Removes such files from the folder and those inside. Only for folders to which nothing else writes at present.
void remove_temporary_files(const std::filesystem::path& folder);

// The user's cache folder for this program ($XDG_CACHE_HOME or ~/.cache, plus "relign-bench"), created
// if missing; empty if it is not writable.
std::filesystem::path cache_folder();

// The first executable file of this name on PATH; empty if there is none.
std::filesystem::path program_on_path(const std::string& name);

}  // namespace relign
