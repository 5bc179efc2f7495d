// relign-bench leaderboard build: a static site from evaluation folders.
#include <ctime>

#include "base/characters.h"
#include "base/error.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/plan_check.h"
#include "leaderboard/board.h"
#include "leaderboard/round.h"
#include "leaderboard/site.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct LeaderboardArguments {
  std::vector<std::string> folders;
  std::string out;
  leaderboard::BoardOptions board;
  CLI::Option* baseline = nullptr;
};

// Of tomorrow, since somewhere it may be tomorrow already.
std::string latest_date() {
  const std::time_t time = std::time(nullptr) + 86400;
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

// Returns whether every round has a ranking.
bool warn_of_doubts(const leaderboard::Board& board) {
  for (const leaderboard::Entry& entry : board.entries)
    if (entry.evaluation.date.substr(0, 10) > latest_date())
      print_warning("'" + entry.evaluation.folder.string() + "': the date '" + entry.evaluation.date +
                    "' is in the future");
  bool all = true;
  for (const leaderboard::Round& round : board.rounds) {
    if (!round.about_baseline.empty())
      print_warning("the baseline of the round '" + round.suite.name + "' is " + round.about_baseline);
    const std::vector<std::string> reasons = leaderboard::reasons_without_ranking(round);
    if (reasons.empty()) continue;
    print_warning("no method of the round '" + round.suite.name + "' is ranked:\n  " + join(reasons, "\n  "));
    all = false;
  }
  return all;
}

void refuse_unknown_baseline(const leaderboard::Board& board) {
  for (const leaderboard::Round& round : board.rounds)
    if (!round.baseline.empty()) return;
  throw Error(ErrorKind::bad_input, "--baseline: no evaluation has a method '" + board.baseline +
                                        "'; there are: " + join(leaderboard::methods_of(board), ", "));
}

int build_site(Context& context, const LeaderboardArguments& arguments) {
  leaderboard::BoardOptions options = arguments.board;
  if (const std::string mistake = line_mistake(options.title); !mistake.empty())
    throw Error(ErrorKind::bad_input, "--title: " + mistake + ", found '" + options.title + "'");
  options.plan = plan_check(context);
  options.folders.assign(arguments.folders.begin(), arguments.folders.end());
  const leaderboard::Board board = leaderboard::make_board(options);
  if (arguments.baseline->count() > 0) refuse_unknown_baseline(board);
  for (const leaderboard::LeftOut& one : board.left_out)
    print_warning("left out: '" + one.folder + "': " + join(one.reasons, "\n  "));
  const bool all_ranked = warn_of_doubts(board);
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
  return board.left_out.empty() && all_ranked ? kDone : kGateTripped;
}

}  // namespace

void add_leaderboard(CLI::App& app, Context& context) {
  CLI::App& parent = add_verb(app, {"leaderboard", "Publish evaluations of submissions as a static site.",
                                    "relign-bench leaderboard build evaluations/* -o site", "report, merge, verify"});
  parent.require_subcommand(1);
  CLI::App& verb =
      add_verb(parent, {"build",
                        "Write a leaderboard as a static site: a ranking per class, a page per method, and a JSON "
                        "feed. Exit code 4 if an evaluation was left out or a round has no ranked method.",
                        "relign-bench leaderboard build evaluations/* -o site\n"
                        "relign-bench leaderboard build evaluations/* -o site --title \"Lens lab\" --baseline bo-gp",
                        "report, merge, verify"});
  LeaderboardArguments& arguments = add_action(verb, context, build_site);
  verb.add_option("DIR", arguments.folders, "evaluation folders; the latest of equal names and suites is ranked")
      ->required()
      ->type_name("DIR");
  verb.add_option("-o,--out", arguments.out, "folder of the site; that of an earlier site is updated")
      ->required()
      ->type_name("FOLDER");
  verb.add_option("--title", arguments.board.title, "title of the site")->type_name("TEXT")->capture_default_str();
  arguments.baseline =
      verb.add_option("--baseline", arguments.board.baseline, "method with which every other is compared")
          ->type_name("METHOD")
          ->capture_default_str();
}

}  // namespace relign::cli
