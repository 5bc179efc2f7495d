#include "records/fresh_folder.h"

#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "records/results_folder.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// The entries of a folder except for these names.
std::vector<fs::path> others(const fs::path& folder, const std::set<std::string>& names) {
  std::vector<fs::path> found;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code))
    if (!names.count(entry->path().filename().string())) found.push_back(entry->path());
  return found;
}

}  // namespace

FreshFolder::FreshFolder(const fs::path& out)
    : out_(out.has_filename() ? out : out.parent_path()),
      fresh_(out_.string() + ".merging"),
      old_(out_.string() + ".merging.old") {
  std::error_code code;
  // Killed between the two moves of put_in_place, or after them.
  if (fs::exists(old_ / "manifest.json", code)) {
    if (!fs::exists(out_, code)) fs::rename(old_, out_, code);
    keep_foreign_files();
  }
  refuse_foreign();
  fs::create_directories(fresh_, code);
  if (code) throw_cannot_write(fresh_, code);
  lock_.emplace(fresh_);
  for (const fs::path& path : others(fresh_, {ResultsLock::kFileName})) fs::remove_all(path, code);
  for (const char* name : {"trials", "times"}) {
    fs::create_directories(fresh_ / name, code);
    if (code) throw_cannot_write(fresh_ / name, code);
  }
}

FreshFolder::~FreshFolder() {
  if (in_place_) return;
  std::error_code code;
  for (const fs::path& path : others(fresh_, {ResultsLock::kFileName})) fs::remove_all(path, code);
  lock_.reset();
  fs::remove(fresh_, code);
}

void FreshFolder::put_in_place() {
  std::error_code code;
  if (fs::exists(out_, code)) {
    const ResultsLock lock(out_);
    fs::remove_all(old_, code);
    fs::rename(out_, old_, code);
    if (code) throw_cannot_write(out_, code);
  }
  fs::rename(fresh_, out_, code);
  if (code) throw_cannot_write(out_, code);
  in_place_ = true;
  fs::remove(out_ / ResultsLock::kFileName, code);
  keep_foreign_files();
}

void FreshFolder::refuse_foreign() const {
  std::error_code code;
  if (!fs::exists(out_, code)) return;
  if (!fs::is_directory(out_, code)) throw Error(ErrorKind::bad_input, out_.string() + " is not a folder");
  const std::optional<Manifest> manifest = read_manifest(out_);
  if (manifest ? manifest->sources.empty() : !fs::is_empty(out_, code))
    throw Error(ErrorKind::bad_input, out_.string() + (manifest ? " contains the results of a run" : " is not empty") +
                                          "; choose a new folder with --out: merge replaces only its own output");
}

void FreshFolder::keep_foreign_files() const {
  static const std::set<std::string> ours = {"manifest.json", "trials",
                                             "times",         "logs",
                                             "pictures",      "scenes",
                                             "aggregate.csv", "costs.csv",
                                             "curves.csv",    "curves.json",
                                             "instances.csv", "matrix.csv",
                                             "report.html",   ResultsLock::kFileName};
  remove_temporary_files(old_);
  std::error_code code;
  for (const fs::path& foreign : others(old_, ours)) {
    fs::rename(foreign, out_ / foreign.filename(), code);
    if (code) throw_cannot_write(foreign, code);
  }
  fs::remove_all(old_, code);
}

}  // namespace relign::records
