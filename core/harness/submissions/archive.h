// Archives of submissions: tar, plain or compressed with gzip or Zstandard. Unpacking takes the archive for hostile: it
// writes plain files into one new folder, or refuses the archive with one sentence and leaves nothing behind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace relign::submissions {

struct ArchiveLimits {
  std::uint64_t archive_bytes = std::uint64_t{512} << 20;  // of the archive itself
  std::size_t entries = 2000;                              // files and folders
  std::uint64_t file_bytes = std::uint64_t{256} << 20;     // of one unpacked file
  std::uint64_t total_bytes = std::uint64_t{512} << 20;    // of all unpacked files
  std::size_t path_length = 200;                           // characters
  std::size_t depth = 12;                                  // folders in each other, with the file
};

// The mistake in the path of an entry; empty if there is none. Allowed are relative paths of letters, digits and
// "._-+@ ", without "." and "..", so that a name means the same on every file system and in every terminal.
std::string path_mistake(const std::string& path, const ArchiveLimits& limits = {});

// The files below `folder`, relative to it and sorted, without hidden ones, those of __pycache__ and `except`. Throws
// Error(bad_input) for a link, a device or a name that an archive must not have, and for what exceeds the limits.
std::vector<std::string> files_to_pack(const std::filesystem::path& folder, const std::filesystem::path& except,
                                       const ArchiveLimits& limits = {});

// Whether the name ends in .tar, .tar.gz or .tar.zst.
bool is_archive_name(const std::filesystem::path& archive);

// Writes these files of `folder` in this order, compressed as the name of `archive` says. Times and owners are zero, so
// that equal files give equal bytes with equal versions of the compressing library. An existing archive is replaced
// when the new one is complete. Throws Error: bad_input for another name, io.
void pack_archive(const std::filesystem::path& folder, const std::vector<std::string>& files,
                  const std::filesystem::path& archive);

// Creates `folder` with the files of the archive. Throws Error: bad_input, with the entry and the limit, if the archive
// is damaged, exceeds a limit, or has anything but files and folders, each once; io. The folder does not exist after an
// error. Before, it must not exist.
void unpack_archive(const std::filesystem::path& archive, const std::filesystem::path& folder,
                    const ArchiveLimits& limits = {});

}  // namespace relign::submissions
