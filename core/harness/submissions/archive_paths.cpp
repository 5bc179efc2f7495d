#include <algorithm>
#include <system_error>

#include "base/error.h"
#include "base/text.h"
#include "submissions/archive.h"

namespace relign::submissions {
namespace fs = std::filesystem;

namespace {

bool is_plain_letter(char letter) {
  const bool word = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z');
  return word || (letter >= '0' && letter <= '9') || std::string("._-+@ ").find(letter) != std::string::npos;
}

// The mistake in one folder or file name; empty if there is none.
std::string name_mistake(const std::string& name) {
  if (name.empty()) return "an empty name is not allowed in a path";
  if (name == "." || name == "..") return "'" + name + "' is not allowed in a path";
  if (!std::all_of(name.begin(), name.end(), is_plain_letter))
    return "a path must consist of letters, digits and '._-+@ '";
  return "";
}

bool is_left_out(const fs::path& name) { return name.string().front() == '.' || name == "__pycache__"; }

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw Error(ErrorKind::bad_input, "'" + printable(file.string()) + "' cannot be packed: " + why);
}

}  // namespace

std::string path_mistake(const std::string& path, const ArchiveLimits& limits) {
  if (path.empty()) return "the path is empty";
  if (path.front() == '/') return "an absolute path is not allowed";
  if (path.size() > limits.path_length)
    return "its path has " + std::to_string(path.size()) + " characters; at most " +
           std::to_string(limits.path_length) + " are allowed";
  std::size_t depth = 0;
  for (std::size_t begin = 0; begin <= path.size(); ++depth) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    if (const std::string mistake = name_mistake(path.substr(begin, end - begin)); !mistake.empty()) return mistake;
    begin = end + 1;
  }
  if (depth > limits.depth)
    return "it is " + std::to_string(depth) + " levels deep; at most " + std::to_string(limits.depth) + " are allowed";
  return "";
}

std::vector<std::string> files_to_pack(const fs::path& folder, const fs::path& except, const ArchiveLimits& limits) {
  std::vector<std::string> files;
  std::uint64_t total = 0;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path& path = entry->path();
    std::error_code ignored;
    if (is_left_out(path.filename())) {
      entry.disable_recursion_pending();
      continue;
    }
    if (entry->is_symlink(ignored)) refuse(path, "it is a link; replace it by a copy of what it leads to");
    const std::string name = path.lexically_relative(folder).generic_string();
    if (const std::string mistake = path_mistake(name, limits); !mistake.empty()) refuse(path, mistake);
    if (entry->is_directory(ignored)) continue;
    if (!entry->is_regular_file(ignored)) refuse(path, "it is neither a file nor a folder");
    if (!except.empty() && fs::equivalent(path, except, ignored)) continue;
    const std::uint64_t size = entry->file_size(ignored);
    total += size;
    if (size > limits.file_bytes || total > limits.total_bytes)
      refuse(path, "with it the files have " + std::to_string(total) + " bytes; allowed are " +
                       std::to_string(limits.file_bytes) + " bytes a file and " + std::to_string(limits.total_bytes) +
                       " bytes together");
    files.push_back(name);
    if (files.size() > limits.entries)
      refuse(path, "the folder has more than " + std::to_string(limits.entries) +
                       " files; submit a folder with the plugin's files only, without its build tree");
  }
  if (error) throw Error(ErrorKind::io, "cannot read folder '" + folder.string() + "': " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

bool is_archive_name(const fs::path& archive) {
  const std::string name = archive.filename().string();
  const auto ends_with = [&name](const std::string& ending) {
    return name.size() > ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
  };
  return ends_with(".tar") || ends_with(".tar.gz") || ends_with(".tar.zst");
}

}  // namespace relign::submissions
