// relign-bench leaderboard build: a static site from evaluation folders.
#include <algorithm>
#include <chrono>
#include <cstdio>

#include "base/error.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "leaderboard/board.h"
#include "leaderboard/site.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct LeaderboardArguments {
  std::vector<std::string> folders;
  std::string out;
  leaderboard::BoardOptions board;
};

void warn_of_doubts(const leaderboard::Board& board) {
  const auto is_ranked = [](const leaderboard::Standing& one) { return one.rank > 0; };
  for (const leaderboard::Round& round : board.rounds)
    if (std::none_of(round.classes.begin(), round.classes.end(), [&](const leaderboard::BoardClass& one) {
          return std::any_of(one.standings.begin(), one.standings.end(), is_ranked);
        }))
      print_warning("no method of the round '" + round.suite.name + "' is ranked; the site states the reasons");
  const std::chrono::sys_days tomorrow =
      std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now()) + std::chrono::days(1);
  const std::chrono::year_month_day day(tomorrow);
  char latest[32];  // somewhere on Earth it may be tomorrow
  std::snprintf(latest, sizeof latest, "%04d-%02u-%02u", int(day.year()), unsigned(day.month()), unsigned(day.day()));
  for (const leaderboard::Entry& entry : board.entries)
    if (entry.evaluation.date.substr(0, 10) > latest)
      print_warning("'" + entry.evaluation.folder.string() + "': the date '" + entry.evaluation.date +
                    "' is in the future");
}

int build_site(const Context& context, const LeaderboardArguments& arguments) {
  leaderboard::BoardOptions options = arguments.board;
  options.folders.assign(arguments.folders.begin(), arguments.folders.end());
  const leaderboard::Board board = leaderboard::make_board(options);
  for (const leaderboard::LeftOut& one : board.left_out)
    print_warning("left out: '" + one.folder + "': " + join(one.reasons, "\n  "));
  warn_of_doubts(board);
  const std::vector<std::string> files = leaderboard::write_site(board, arguments.out);
  const std::size_t methods = leaderboard::methods_of(board).size();
  if (context.json) {
    Json left_out = Json::array();
    for (const leaderboard::LeftOut& one : board.left_out) left_out.push_back(one.folder);
    print_result(Json({{"site", arguments.out}, {"files", files}, {"left_out", left_out}}).dump(2) + "\n");
  } else {
    print_text("site         " + (fs::path(arguments.out) / "index.html").string() + "\nevaluations  " +
               std::to_string(board.entries.size()) + " of " + std::to_string(arguments.folders.size()) +
               "\nmethods      " + std::to_string(methods) + "\n");
  }
  return board.left_out.empty() ? kDone : kGateTripped;
}

}  // namespace

void add_leaderboard(CLI::App& app, Context& context) {
  CLI::App& parent = add_verb(app, {"leaderboard", "Publish evaluations of submissions as a static site.",
                                    "relign-bench leaderboard build evaluations/* -o site", "report, merge, verify"});
  parent.require_subcommand(1);
  CLI::App& verb =
      add_verb(parent, {"build",
                        "Write a leaderboard as a static site: a ranking per class, a page per method with its replay "
                        "and versions, and a JSON feed. Exit code 4 if an evaluation was left out, because its parts "
                        "contradict each other.",
                        "relign-bench leaderboard build evaluations/* -o site\n"
                        "relign-bench leaderboard build evaluations/* -o site --title \"Lens lab\" --baseline bo-gp",
                        "report, merge, verify"});
  auto arguments = std::make_shared<LeaderboardArguments>();
  verb.add_option("DIR", arguments->folders, "evaluation folders; the latest of equal names and suites is ranked")
      ->required()
      ->type_name("DIR");
  verb.add_option("-o,--out", arguments->out, "folder of the site; that of an earlier site is updated")
      ->required()
      ->type_name("FOLDER");
  verb.add_option("--title", arguments->board.title, "title of the site")->type_name("TEXT")->capture_default_str();
  verb.add_option("--baseline", arguments->board.baseline, "method with which every other is compared")
      ->type_name("METHOD")
      ->capture_default_str();
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return build_site(context, *arguments); }; });
}

}  // namespace relign::cli
