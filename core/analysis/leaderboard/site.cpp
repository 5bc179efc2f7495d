#include "leaderboard/site.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"
#include "leaderboard/feed.h"
#include "report/report.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;

bool is_site(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_regular_file(folder / "feed.json", ignored)) return false;
  const Json known = parsed_json(read_file(folder / "feed.json"));
  return known.is_object() && text_of(known, "format") == kFeedFormat;
}

void require_own(const fs::path& folder) {
  std::error_code code;
  if (!fs::exists(folder, code)) return;
  if (!fs::is_directory(folder, code))
    throw Error(ErrorKind::bad_input, "--out: '" + folder.string() + "' is not a folder");
  if (!fs::is_empty(folder, code) && !is_site(folder))
    throw Error(ErrorKind::bad_input, "--out: '" + folder.string() +
                                          "' has files, but not of a leaderboard; choose a new or empty folder, or "
                                          "that of an earlier site");
}

// Pages of an earlier site, recognised by their names.
void remove_others(const fs::path& folder, const std::set<std::string>& written) {
  for (const char* inner : {"methods", "reports"}) {
    std::error_code code;
    std::vector<fs::path> stale;
    for (fs::directory_iterator file(folder / inner, code), end; !code && file != end; file.increment(code))
      if (file->path().extension() == ".html" && !fs::is_directory(file->symlink_status()) &&
          !written.count(std::string(inner) + "/" + file->path().filename().string()))
        stale.push_back(file->path());
    for (const fs::path& file : stale) fs::remove(file, code);
  }
}

}  // namespace

std::vector<std::string> methods_of(const Board& board) {
  std::vector<std::string> methods;
  for (const Round& round : board.rounds)
    for (const BoardClass& of_class : round.classes)
      for (const Standing& standing : of_class.standings)
        if (std::find(methods.begin(), methods.end(), standing.method) == methods.end())
          methods.push_back(standing.method);
  return methods;
}

std::vector<std::string> write_site(const Board& board, const fs::path& folder) {
  require_own(folder);
  std::set<std::string> written;
  const auto write = [&](const std::string& file, const std::string& text) {
    write_file_atomically(folder / file, text);
    written.insert(file);
  };
  // First: it marks the folder as a site, should this be interrupted.
  write("feed.json", feed(board).dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  for (const Entry& entry : board.entries)
    write(entry.report, report::Report(entry.evaluation.results_folder(), std::nullopt, board.plan).html());
  for (const std::string& method : methods_of(board)) write(method_page(method), method_html(board, method));
  write("index.html", index_html(board));
  remove_others(folder, written);
  return {written.begin(), written.end()};
}

}  // namespace relign::leaderboard
