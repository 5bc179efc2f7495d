// Archives that a stranger may send, each with the words with which it is refused.
#pragma once

#include <archive.h>
#include <archive_entry.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace relign::submissions_test {

// Writes what no honest tool does. `compress` is libarchive's name of a filter, or "".
class ArchiveMaker {
 public:
  explicit ArchiveMaker(const std::filesystem::path& file, const std::string& filter = "gzip")
      : writer_(archive_write_new()) {
    archive_write_set_format_pax(writer_);
    if (!filter.empty()) archive_write_add_filter_by_name(writer_, filter.c_str());
    if (archive_write_open_filename(writer_, file.c_str()) != ARCHIVE_OK) throw std::runtime_error("cannot write");
  }
  ~ArchiveMaker() { archive_write_free(writer_); }
  ArchiveMaker(const ArchiveMaker&) = delete;
  ArchiveMaker& operator=(const ArchiveMaker&) = delete;

  using Change = std::function<void(archive_entry*)>;
  void add(const std::string& name, const std::string& content = "x", const Change& change = {}) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    if (change) change(entry);
    if (archive_write_header(writer_, entry) < ARCHIVE_WARN) throw std::runtime_error(archive_error_string(writer_));
    archive_write_data(writer_, content.data(), content.size());
    archive_entry_free(entry);
  }
  void add_special(const std::string& name, unsigned type, const Change& change = {}) {
    add(name, "", [&](archive_entry* entry) {
      archive_entry_set_filetype(entry, type);
      if (change) change(entry);
    });
  }

 private:
  archive* writer_;
};

struct Hostile {
  const char* name;
  const char* refusal;  // part of the message
  std::function<void(const std::filesystem::path&)> write;
};

inline std::vector<Hostile> hostile_archives() {
  using Path = std::filesystem::path;
  const auto one = [](const std::string& name) { return [name](const Path& file) { ArchiveMaker(file).add(name); }; };
  const auto special = [](unsigned type, const ArchiveMaker::Change& change = {}) {
    return [=](const Path& file) { ArchiveMaker(file).add_special("entry", type, change); };
  };
  const auto several = [](const std::vector<std::string>& names) {
    return [names](const Path& file) {
      ArchiveMaker maker(file);
      for (const std::string& name : names) maker.add(name);
    };
  };
  // 300 MB of zeros in 300 kB.
  const auto bomb = [](const char* filter) {
    return [=](const Path& file) { ArchiveMaker(file, filter).add("bomb", std::string(300'000'000, '\0')); };
  };
  const auto text = [](const std::string& content) {
    return [content](const Path& file) {
      FILE* stream = fopen(file.c_str(), "wb");
      fwrite(content.data(), 1, content.size(), stream);
      fclose(stream);
    };
  };
  return {
      {"absolute_path", "entry '/tmp/relign_escaped': an absolute path is not allowed", one("/tmp/relign_escaped")},
      {"parent_folder", "entry '../escaped': '..' is not allowed", one("../escaped")},
      {"parent_inside", "entry 'a/../../escaped': '..' is not allowed", one("a/../../escaped")},
      {"dot", "'.' is not allowed", one("./a")},
      {"empty_name", "an empty name is not allowed", one("a//b")},
      {"terminal_sequence", "a path must consist of letters", one("a\x1b[2Jb")},
      {"backslash", "a path must consist of letters", one("a\\b")},
      {"long_path", "its path has 201 characters; at most 200 are allowed", one(std::string(201, 'a'))},
      {"deep_path", "it is 13 levels deep; at most 12 are allowed", one("a/a/a/a/a/a/a/a/a/a/a/a/a")},
      {"symbolic_link", "entry 'entry': it is a symbolic link",
       special(AE_IFLNK, [](archive_entry* entry) { archive_entry_set_symlink(entry, "/etc/passwd"); })},
      {"hard_link", "entry 'entry': it is a hard link",
       special(AE_IFREG, [](archive_entry* entry) { archive_entry_set_hardlink(entry, "/etc/passwd"); })},
      {"device", "entry 'entry': it is a device",
       special(AE_IFCHR, [](archive_entry* entry) { archive_entry_set_rdevmajor(entry, 1); })},
      {"named_pipe", "entry 'entry': it is a named pipe", special(AE_IFIFO)},
      {"sparse_file", "entry 'holes': it is a sparse file",
       [](const Path& file) {
         ArchiveMaker(file).add("holes", "x", [](archive_entry* entry) {
           archive_entry_set_size(entry, la_int64_t{1} << 40);
           archive_entry_sparse_add_entry(entry, 0, 1);
         });
       }},
      {"duplicate", "entry 'a': it occurs twice", several({"a", "a"})},
      {"file_and_folder", "'a' is both a file and a folder", several({"a", "a/b"})},
      {"folder_and_file", "entry 'a': it occurs twice", several({"a/b", "a"})},
      {"gzip_bomb", "entry 'bomb': it unpacks to more than 268435456 bytes", bomb("gzip")},
      {"zstd_bomb", "entry 'bomb': it unpacks to more than 268435456 bytes", bomb("zstd")},
      {"many_files", "it has more than 2000 entries",
       [](const Path& file) {
         ArchiveMaker maker(file);
         for (int i = 0; i < 2001; ++i) maker.add("f" + std::to_string(i), "");
       }},
      {"many_folders", "it has more than 2000 entries",
       [](const Path& file) {
         ArchiveMaker maker(file);
         for (int i = 0; i < 2001; ++i) maker.add_special("f" + std::to_string(i), AE_IFDIR);
       }},
      {"no_archive", "not a tar archive", text("#!/bin/sh\necho hello\n")},
      {"empty_file", "not a tar archive", text("")},
      {"truncated", "after entry 'long': it is damaged",
       [](const Path& file) {
         ArchiveMaker(file, "").add("long", std::string(100'000, 'x'));
         std::filesystem::resize_file(file, 50'000);
       }},
      {"other_filter", "not a tar archive", [](const Path& file) { ArchiveMaker(file, "bzip2").add("a"); }},
  };
}

}  // namespace relign::submissions_test
