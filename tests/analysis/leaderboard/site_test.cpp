// The site as files, and in a real browser where there is one.
#include "leaderboard/site.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <regex>
#include <set>

#include "error_text.h"
#include "leaderboard/made_evaluations.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Without the terminal sequence, which is refused.
const std::string kHostile = report::kHostile.substr(0, report::kHostile.find('\x1b'));

class LeaderboardSite : public MadeEvaluations {
 protected:
  // Hostile in every text that a submission chooses.
  fs::path hostile(const std::string& name = kHostile) {
    const fs::path folder = evaluation(
        "h", {{name, {"merit", "box"}, 0.05, true, {1}}, random(), {"sees", {"images"}, 0.02}},
        {{"name", name}, {"version", kHostile}, {"program_version", kHostile}, {"suite", {{"name", kHostile}}}},
        {{"program", {{"version", kHostile}}}, {"suite_name", report::kHostile}});
    Json submission = Json::parse(read_file(folder / "submission.json"));
    for (const char* key : {"summary", "licence", "citation", "homepage"}) submission[key] = kHostile;
    submission["authors"] = {kHostile};
    write_file_atomically(folder / "submission.json", submission.dump());
    return folder;
  }
  static std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  }
};

TEST_F(LeaderboardSite, EscapesEverythingThatSubmissionsChoose) {
  const Board board = board_of({hostile()});
  for (const std::string& page : {index_html(board), method_html(board, kHostile)}) {
    EXPECT_THAT(page, Not(HasSubstr("<img")));
    EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
    EXPECT_THAT(page, Not(HasSubstr("\x1b")));
    EXPECT_THAT(page, HasSubstr("&quot;&gt;&lt;img src=x onerror=alert(1)&gt;"));
    EXPECT_THAT(page, HasSubstr("default-src 'none'"));
    EXPECT_THAT(page, Not(HasSubstr("'unsafe-inline'; script-src 'unsafe-inline'")));
    EXPECT_EQ(count(page, "<script>"), count(page, "'sha256-")) << "every script has its hash in the policy";
  }
  EXPECT_THAT(method_html(board, kHostile), Not(HasSubstr("href=\"&quot;"))) << "an address that is none is no link";
}

TEST_F(LeaderboardSite, LinksOnlyWebAddresses) {
  const fs::path folder = evaluation("e", {{"mine", {"merit"}, 0.05, true}});
  const auto page = [&](const std::string& homepage) {
    Json submission = Json::parse(read_file(folder / "submission.json"));
    submission["homepage"] = homepage;
    write_file_atomically(folder / "submission.json", submission.dump());
    return method_html(board_of({folder}), "mine");
  };
  EXPECT_THAT(page("https://example.org/a?b=1&c=2"), HasSubstr("href=\"https://example.org/a?b=1&amp;c=2\""));
  for (const char* address : {"javascript:alert(1)", "data:text/html,x", "file:///etc/passwd", " https://example.org"})
    EXPECT_THAT(page(address), Not(HasSubstr("href=\"" + std::string(address)))) << address;
}

TEST_F(LeaderboardSite, PagesOfMethodsHaveFilesOfTheirOwn) {
  EXPECT_NE(method_page("a/b"), method_page("a-b"));
  for (const std::string& name : {std::string("../../etc/passwd"), kHostile, std::string(5000, 'x'), std::string("")})
    EXPECT_TRUE(std::regex_match(method_page(name), std::regex("methods/[A-Za-z0-9._-]{0,60}-[0-9a-f]{8}\\.html")))
        << name;
}

TEST_F(LeaderboardSite, CanBeReadWithoutSeeingIt) {
  const Board board = board_of({hostile("mine")});
  for (const std::string& page : {index_html(board), method_html(board, "mine")}) {
    EXPECT_THAT(page, HasSubstr("<html lang=\"en\">"));
    EXPECT_THAT(page, AllOf(HasSubstr("<a class=\"skip\" href=\"#main\">"), HasSubstr("<main id=\"main\""),
                            HasSubstr("<nav aria-label="), HasSubstr("<footer>")));
    EXPECT_EQ(count(page, "<table"), count(page, "<caption"));
    EXPECT_EQ(count(page, "<th"), count(page, "<th scope=") + count(page, "<thead"));
    EXPECT_EQ(count(page, "<h1"), 1U);
  }
}

TEST_F(LeaderboardSite, ShowsFailuresVersionsAndConditions) {
  const fs::path old =
      evaluation("v1", {{"mine", {"merit", "box"}, 0.06, true, {}, "blind", {{"v", 1}}}, random()},
                 {{"version", "0.9"}, {"date", "2026-11-01"}, {"archive_sha256", std::string(64, 'd')}});
  const fs::path now =
      evaluation("v2", {{"mine", {"merit", "box"}, 0.05, true, {1, 3}, "blind", {{"v", 2}}}, random()});
  const Board board = board_of({old, now});
  const std::string index = index_html(board), page = method_html(board, "mine");
  EXPECT_THAT(index, AllOf(HasSubstr(">2 of 8<"), HasSubstr(">not sealed<"), HasSubstr(">no sandbox<")));
  EXPECT_THAT(page, AllOf(HasSubstr("2 of 8 trials failed"), HasSubstr("2 trials: <bdi>it broke: mine</bdi>"),
                          HasSubstr("<h2>Versions</h2>"), HasSubstr("<bdi>0.9</bdi>"), HasSubstr("2026-11-01")));
  EXPECT_THAT(page, HasSubstr("<bdi>A. Tester</bdi>"));
  EXPECT_THAT(method_html(board, "random"), HasSubstr("baseline: part of relign-bench"));
}

TEST_F(LeaderboardSite, IsWrittenAndUpdated) {
  const fs::path site = folder_ / "site";
  const auto files_of = [&] {
    std::set<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(site))
      if (entry.is_regular_file()) files.insert(fs::relative(entry.path(), site).string());
    return files;
  };
  const std::vector<std::string> first =
      write_site(board_of({evaluation("a", {{"gone", {"merit"}, 0.05, true}, random()})}), site);
  EXPECT_EQ(files_of(), std::set<std::string>(first.begin(), first.end()));
  EXPECT_EQ(first.size(), 5U) << "index, feed, two methods, one report";
  const fs::path later = evaluation("b", {{"new", {"merit"}, 0.05, true}});
  const std::vector<std::string> second = write_site(board_of({later}), site);
  EXPECT_EQ(files_of(), std::set<std::string>(second.begin(), second.end()))
      << "pages of methods that are gone are, too";
  const std::string feed = read_file(site / "feed.json");
  write_site(board_of({later}), site);
  EXPECT_EQ(read_file(site / "feed.json"), feed) << "equal evaluations, equal bytes";
  // Links lead to files.
  const std::string index = read_file(site / "index.html");
  const std::regex link("href=\"((?:methods|reports)/[^\"]+)\"");
  std::size_t links = 0;
  for (std::sregex_iterator it(index.begin(), index.end(), link), end; it != end; ++it, ++links)
    EXPECT_TRUE(fs::exists(site / (*it)[1].str())) << (*it)[1];
  EXPECT_GE(links, 2U);
}

TEST_F(LeaderboardSite, LeavesForeignFoldersAlone) {
  const Board board = board_of({evaluation("a", {{"mine", {"merit"}, 0.05, true}})});
  write_file_atomically(folder_ / "mine/thesis.txt", "x");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { write_site(board, folder_ / "mine"); }),
              HasSubstr("has files, but not of a leaderboard"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { write_site(board, folder_ / "mine/thesis.txt"); }),
              HasSubstr("is not a folder"));
  EXPECT_TRUE(fs::exists(folder_ / "mine/thesis.txt"));
}

// Nothing runs, nothing is requested, and a phone need not scroll sideways.
TEST_F(LeaderboardSite, WorksInABrowserOnAPhone) {
  if (std::system("command -v chromium >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "chromium is not installed: the site was not tested in a browser";
  const Board board = board_of({hostile("name-without-a-place-to-break-" + std::string(150, 'x'))});
  write_site(board, folder_ / "site");
  std::vector<std::string> pages = {"index.html"};
  for (const std::string& method : methods_of(board)) pages.push_back(method_page(method));
  for (const std::string& page : pages) {
    const fs::path file = folder_ / "site" / page;
    std::string text = read_file(file);
    text = std::regex_replace(text, std::regex("<meta http-equiv[^>]*>"), "");
    text.insert(text.rfind("</body>"),
                "<script>document.documentElement.dataset.fits = String(innerWidth < 600 && "
                "document.documentElement.scrollWidth <= innerWidth); document.documentElement.dataset.sorts = "
                "document.querySelectorAll('thead "
                "button').length;</script>");
    write_file_atomically(folder_ / "site" / (page + "-probe.html"), text);
    for (const bool probe : {false, true}) {
      const std::string command =
          "timeout 60 chromium --headless=new --no-sandbox --disable-gpu --no-first-run "
          "--disable-background-networking --disable-component-update --proxy-server=127.0.0.1:9 --user-data-dir='" +
          (folder_ / "profile").string() +
          "' --window-size=390,900 --virtual-time-budget=4000 --enable-logging=stderr "
          "--dump-dom 'file://" +
          file.string() + (probe ? "-probe.html" : "") + "' >'" + (folder_ / "dom").string() + "' 2>'" +
          (folder_ / "log").string() + "'";
      EXPECT_EQ(std::system(command.c_str()), 0) << read_file(folder_ / "log");
      EXPECT_THAT(read_file(folder_ / "log"), Not(HasSubstr("CONSOLE"))) << page;
      const std::string dom = read_file(folder_ / "dom");
      EXPECT_EQ(dom.find("<img"), std::string::npos);
      if (!probe) continue;
      EXPECT_NE(dom.find("data-fits=\"true\""), std::string::npos) << page << " scrolls sideways";
      EXPECT_EQ(dom.find("data-sorts=\"0\""), std::string::npos) << page;
    }
  }
}

}  // namespace
}  // namespace relign::leaderboard
