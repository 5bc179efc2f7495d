#include <archive.h>
#include <archive_entry.h>

#include <cstring>
#include <memory>
#include <optional>

#include "base/error.h"
#include "base/files.h"
#include "submissions/archive.h"

namespace relign::submissions {
namespace fs = std::filesystem;

namespace {

struct CloseWriter {
  void operator()(struct archive* writer) const { archive_write_free(writer); }
};
struct FreeEntry {
  void operator()(struct archive_entry* entry) const { archive_entry_free(entry); }
};

// The file behind libarchive's callbacks, which no exception may pass.
struct Output {
  explicit Output(const fs::path& path) : file(path) {}
  AtomicFile file;
  std::optional<Error> failure;
};

la_ssize_t write_piece(struct archive*, void* data, const void* piece, size_t length) {
  auto& output = *static_cast<Output*>(data);
  try {
    output.file.write({static_cast<const char*>(piece), length});
    return static_cast<la_ssize_t>(length);
  } catch (const Error& error) {
    output.failure = error;
    return -1;
  }
}

class Writer {
 public:
  explicit Writer(const fs::path& archive) : name_(archive), output_(archive), writer_(archive_write_new()) {
    struct archive* writer = writer_.get();
    check(archive_write_set_format_pax_restricted(writer));
    if (archive.extension() == ".gz") {
      check(archive_write_add_filter_gzip(writer));
      check(archive_write_set_filter_option(writer, "gzip", "timestamp", nullptr));
    } else if (archive.extension() == ".zst") {
      check(archive_write_add_filter_zstd(writer));
      check(archive_write_set_filter_option(writer, "zstd", "compression-level", "19"));
    }
    check(archive_write_set_bytes_in_last_block(writer, 1));
    check(archive_write_open(writer, &output_, nullptr, write_piece, nullptr));
  }

  void add(const fs::path& source, const std::string& name) {
    const std::string content = read_file(source);
    const bool runs = (fs::status(source).permissions() & fs::perms::owner_exec) != fs::perms::none;
    const std::unique_ptr<struct archive_entry, FreeEntry> entry(archive_entry_new());
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), runs ? 0755 : 0644);
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(content.size()));
    archive_entry_set_mtime(entry.get(), 0, 0);
    check(archive_write_header(writer_.get(), entry.get()));
    if (archive_write_data(writer_.get(), content.data(), content.size()) != static_cast<la_ssize_t>(content.size()))
      fail();
  }

  void finish() {
    check(archive_write_close(writer_.get()));
    output_.file.commit();
  }

 private:
  void check(int status) {
    if (status != ARCHIVE_OK) fail();
  }
  [[noreturn]] void fail() {
    if (output_.failure) throw *output_.failure;
    throw Error(ErrorKind::io, "cannot write '" + name_.string() + "': " + std::strerror(archive_errno(writer_.get())));
  }

  fs::path name_;
  Output output_;
  std::unique_ptr<struct archive, CloseWriter> writer_;
};

}  // namespace

void pack_archive(const fs::path& folder, const std::vector<std::string>& files, const fs::path& archive) {
  if (!is_archive_name(archive))
    throw Error(ErrorKind::bad_input,
                "'" + archive.string() + "' must end in .tar.zst, .tar.gz or .tar, the formats of a submission");
  Writer writer(archive);
  for (const std::string& file : files) writer.add(folder / file, file);
  writer.finish();
}

}  // namespace relign::submissions
