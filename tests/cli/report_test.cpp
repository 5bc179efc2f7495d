// report on the command line: the scene on the page, figures for a paper, several folders on one page.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

// Checks that elements are properly nested and that there is one root. Returns the mistake, or "".
std::string xml_mistake(const std::string& text) {
  static const std::regex kTag("<(/?)([A-Za-z][A-Za-z0-9]*)((?:\\s+[A-Za-z:-]+=\"[^\"<]*\")*)\\s*(/?)>");
  std::vector<std::string> open;
  std::size_t roots = 0;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    if (text.compare(at, 2, "<?") == 0) continue;
    std::smatch tag;
    const std::string rest = text.substr(at);
    if (!std::regex_search(rest, tag, kTag, std::regex_constants::match_continuous))
      return "no tag: " + rest.substr(0, 60);
    if (tag[1] == "/") {
      if (open.empty() || open.back() != tag[2]) return "closes another element: " + tag.str();
      open.pop_back();
    } else {
      if (open.empty()) ++roots;
      if (tag[4] != "/") open.push_back(tag[2]);
    }
  }
  if (!open.empty()) return "never closed: " + open.back();
  return roots == 1 ? "" : std::to_string(roots) + " roots";
}

TEST(XmlMistake, IsDetected) {
  EXPECT_EQ(xml_mistake("<svg a=\"1\"><g><path d=\"M\"/></g></svg>"), "");
  for (const char* text : {"<svg><g></svg>", "<svg>", "<svg a=1></svg>", "<svg/><svg/>", "a < b", "<svg t=\"<b>\"/>"})
    EXPECT_NE(xml_mistake(text), "") << text;
}

class CliReport : public testing::Test {
 protected:
  // report --open, with only these variables of a desktop.
  Outcome open(const std::string& variables, const std::string& arguments = "r --open") {
    return shell(place_, "unset DISPLAY WAYLAND_DISPLAY BROWSER SSH_CONNECTION; export PATH=\"$PWD/bin:$PATH\"; " +
                             variables + " \"$RELIGN_BENCH\" report " + arguments);
  }
  void run(const std::string& name, const std::string& algorithms, int seed = 1) {
    place_.write(name + ".json", json{{"name", name},
                                      {"scenes", {"relign_od"}},
                                      {"noise_levels", {"rho0", "rho0.5"}},
                                      {"algorithms", json::parse(algorithms)},
                                      {"instances", 2},
                                      {"steps", 3},
                                      {"seed", seed}}
                                     .dump());
    const Outcome outcome = relign_bench(place_, {"run", name + ".json", "-o", name});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  Workplace place_;
};

TEST_F(CliReport, PageShowsTheSceneWithLensAndLandscape) {
  run("one", R"(["nlopt-sbplx"])");
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(place_.path("one/scenes")))
    files.insert(entry.path().filename().string());
  EXPECT_THAT(files, testing::IsSupersetOf({"description.json", "reference.png", "lens.svg"}));
  const std::string page = place_.read("one/report.html");
  EXPECT_THAT(page, AllOf(HasSubstr("<h2>Scene<"), HasSubstr("<img src=\"data:image/svg+xml;base64,"),
                          HasSubstr("x -1 to 1 mm")));
  // The landscape is left out if it takes too long, as on a busy machine.
  if (files.count("landscape.json") > 0) {
    EXPECT_THAT(page, HasSubstr("\"map\":{\"across\""));
  }
}

TEST_F(CliReport, WritesWellFormedFigures) {
  run("one", R"(["nlopt-sbplx"])");
  const Outcome outcome = relign_bench(place_, {"report", "one", "--figures", "paper", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["reports"], json({"one/report.html"}));
  std::set<std::string> names, listed;
  for (const auto& entry : fs::directory_iterator(place_.path("paper")))
    names.insert("paper/" + entry.path().filename().string());
  for (const json& file : result["figures"]) listed.insert(file);
  EXPECT_EQ(names, listed);
  EXPECT_THAT(names, testing::IsSupersetOf({"paper/curves-1-rho0.svg", "paper/curves-2-rho0.5.csv",
                                            "paper/targets-1-rho0.svg", "paper/misalignment-mm-1-rho0.svg"}));
  for (const std::string& name : names) {
    const std::string text = place_.read(name);
    if (fs::path(name).extension() == ".svg") {
      EXPECT_EQ(xml_mistake(text), "") << name;
      EXPECT_THAT(text, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\"")) << name;
      EXPECT_EQ(names.count(fs::path(name).replace_extension(".csv").string()), 1U) << "its numbers";
      continue;
    }
    ASSERT_EQ(fs::path(name).extension(), ".csv");
    std::istringstream lines(text);
    std::string line;
    std::ptrdiff_t commas = 0;
    for (int row = 0; std::getline(lines, line); ++row) {
      line = std::regex_replace(line, std::regex("\"[^\"]*\""), "quoted");  // may hold commas
      if (row == 0) commas = std::count(line.begin(), line.end(), ',');
      EXPECT_EQ(std::count(line.begin(), line.end(), ','), commas) << name << ": " << line;
    }
    EXPECT_EQ(commas, 4) << name;
  }
  EXPECT_THAT(relign_bench(place_, {"report", "--help"}).out,
              AllOf(HasSubstr("--figures"), HasSubstr("SVG"), HasSubstr("CSV")));
}

TEST_F(CliReport, CombinesFoldersOnOnePage) {
  run("mine", R"(["nlopt-sbplx"])");
  run("theirs", R"(["nlopt-bobyqa"])");
  run("later", R"(["nlopt-sbplx"])", 2);
  const std::string before = place_.read("mine/report.html");
  const Outcome both = relign_bench(place_, {"report", "mine", "theirs", "-o", "both.html", "--figures", "paper"});
  ASSERT_EQ(both.exit_code, 0) << both.err;
  EXPECT_THAT(both.out, testing::StartsWith("both.html\n"));
  EXPECT_THAT(place_.read("both.html"),
              AllOf(HasSubstr("nlopt-bobyqa"), HasSubstr("nlopt-sbplx"), HasSubstr("Merged from 2 results folders")));
  EXPECT_THAT(place_.read("paper/curves-1-rho0.csv"), AllOf(HasSubstr("nlopt-bobyqa,"), HasSubstr("nlopt-sbplx,")));
  EXPECT_EQ(place_.read("mine/report.html"), before);
  const Outcome apart = relign_bench(place_, {"report", "mine", "later", "-o", "apart.html"});
  ASSERT_EQ(apart.exit_code, 0) << apart.err;
  EXPECT_THAT(place_.read("apart.html"), AllOf(HasSubstr("mine: rho0"), HasSubstr("later: rho0")));
  // Without --out each folder has its own page, so that one folder of figures is ambiguous.
  const Outcome each = relign_bench(place_, {"report", "mine", "later"});
  EXPECT_EQ(each.out, "mine/report.html\nlater/report.html\n");
  const Outcome refused = relign_bench(place_, {"report", "mine", "later", "--figures", "paper"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("add --out PAGE"));
}

TEST_F(CliReport, OpensThePage) {
  run("r", R"(["random"])");
  // A browser that notes what it gets, and one that fails.
  place_.write("bin/xdg-open", "#!/bin/sh\necho \"xdg-open $*\" >> opened\n");
  place_.write("bin/firefly", "#!/bin/sh\necho \"firefly $*\" >> opened\n");
  place_.write("bin/broken", "#!/bin/sh\nexit 3\n");
  ASSERT_EQ(shell(place_, "chmod +x bin/*").exit_code, 0);
  const std::string page = fs::canonical(place_.path("r")) / "report.html";

  fs::remove(page);
  Outcome outcome = open("DISPLAY=:7");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "r/report.html\n");
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(fs::exists(page));
  EXPECT_EQ(open("WAYLAND_DISPLAY=wayland-0 SSH_CONNECTION='1 2 3 4'").exit_code, 0);
  EXPECT_EQ(open("BROWSER='nowhere:broken:firefly --new %s:xdg-open'").exit_code, 0);
  EXPECT_EQ(place_.read("opened"), "xdg-open " + page + "\nxdg-open " + page + "\nfirefly --new " + page + "\n");
}

TEST_F(CliReport, StatesHowToCopyThePageWhereItCannotBeOpened) {
  run("r", R"(["random"])");
  place_.write("bin/xdg-open", "#!/bin/sh\nexit 4\n");
  ASSERT_EQ(shell(place_, "chmod +x bin/xdg-open").exit_code, 0);
  const std::string copy = ":" + (fs::canonical(place_.path("r")) / "report.html").string() + " .\n";
  for (const auto& [variables, problem] : std::vector<std::pair<std::string, std::string>>{
           {"", "no display here"},
           {"SSH_CONNECTION='10.0.0.1 50000 10.0.0.2 22'", "no display in this SSH session"},
           {"DISPLAY=:7", "xdg-open could not open the page"},
           {"DISPLAY=:7 BROWSER=nowhere", "no program of BROWSER='nowhere' could open the page"}}) {
    const Outcome outcome = open(variables);
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.out, "r/report.html\n");
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("Not opened: " + problem + ". "), HasSubstr("\n  scp "), HasSubstr(copy)));
  }
  for (const char* arguments : {"r --open --out -", "r --open --format csv"}) {
    const Outcome refused = open("", arguments);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("--open: requires a page in a file, found --"));
  }
}

}  // namespace
}  // namespace relign::cli_test
