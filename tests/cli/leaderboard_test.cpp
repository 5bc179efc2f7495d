// leaderboard build on the command line: from a run to a site.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"
#include "resealed.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class CliLeaderboard : public testing::Test {
 protected:
  // An evaluation folder of a run of the tiny suite, in which nlopt-sbplx was submitted.
  void evaluate(const std::string& folder, const json& change = json::object()) {
    if (!fs::exists(place_.path("run"))) {
      place_.write("tiny.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "instances": 2, "steps": 3,
                                    "algorithms": ["random", "nlopt-sbplx"]})");
      const Outcome run = relign_bench(place_, {"run", "tiny.json", "-o", "run"});
      ASSERT_EQ(run.exit_code, 0) << run.err;
    }
    fs::create_directories(place_.path(folder));
    fs::copy(place_.path("run"), place_.path(folder + "/results"), fs::copy_options::recursive);
    const json manifest = json::parse(place_.read("run/manifest.json"));
    json methods = json::array(), own;
    for (const json& entry : manifest["algorithms"]) {
      json method = {{"name", entry["name"]},
                     {"observes", entry["observes"]},
                     {"protocol", entry["protocol"]},
                     {"training", nullptr},
                     {"submitted", own.is_null() && entry["name"] != "random" && entry["name"] != "home"}};
      if (method["submitted"]) own = method;
      methods.push_back(method);
    }
    json evaluation = {
        {"format", "relign-bench/evaluation/1"},
        {"name", own["name"]},
        {"version", "1.0"},
        {"archive_sha256", std::string(64, '0')},
        {"suite", {{"name", "tiny"}, {"sha256", std::string(64, '1')}, {"instance_set", manifest["instance_set"]}}},
        {"sealed", false},
        {"sandbox", false},
        {"date", "2026-11-24"},
        {"program_version", manifest["program"]["version"]},
        {"class", own["observes"]},
        {"budget", {{"steps", 3}}},
        {"methods", methods}};
    evaluation.merge_patch(change);
    place_.write(folder + "/evaluation.json", evaluation.dump());
    place_.write(folder + "/submission.json",
                 json({{"name", evaluation["name"]}, {"version", evaluation["version"]}}).dump());
    name_ = own["name"];
  }
  Workplace place_;
  std::string name_;
};

TEST_F(CliLeaderboard, BuildsASiteFromARun) {
  evaluate("mine");
  const Outcome built = relign_bench(place_, {"leaderboard", "build", "mine", "-o", "site", "--title", "A <b>lab</b>"});
  EXPECT_EQ(built.exit_code, 0) << built.err;
  EXPECT_THAT(built.out, AllOf(HasSubstr("site         site/index.html"), HasSubstr("evaluations  1 of 1")));
  EXPECT_THAT(place_.read("site/index.html"), HasSubstr("<h1><bdi>A &lt;b&gt;lab&lt;/b&gt;</bdi></h1>"));
  const json feed = json::parse(place_.read("site/feed.json"));
  std::size_t standings = 0;
  for (const json& of_class : feed["rounds"][0]["classes"])
    for (const json& standing : of_class["methods"]) {
      ++standings;
      EXPECT_EQ(standing["failed"], 0);
      const std::string page = place_.read("site/" + standing["page"].get<std::string>());
      EXPECT_THAT(page, AllOf(HasSubstr("<section id=\"replay\""), HasSubstr("data:image/webp;base64,"),
                              HasSubstr(standing["method"].get<std::string>())));
    }
  EXPECT_GE(standings, 3U);
  EXPECT_THAT(place_.read("site/" + feed["submissions"][0]["versions"][0]["report"].get<std::string>()),
              HasSubstr("<h2>Ranking</h2>"));
}

TEST_F(CliLeaderboard, ReportsWhatItLeavesOut) {
  evaluate("mine");
  evaluate("forged", {{"version", "2.0"}, {"sandbox", true}});
  const Outcome built = relign_bench(place_, {"leaderboard", "build", "mine", "forged", "-o", "site", "--json"});
  EXPECT_EQ(built.exit_code, 4);
  EXPECT_THAT(built.err,
              HasSubstr("left out: 'forged': 'sandbox' is true, but no algorithm of the results ran in a sandbox"));
  EXPECT_EQ(json::parse(built.out)["left_out"], json({"forged"}));
  EXPECT_THAT(place_.read("site/index.html"), HasSubstr("<h2 id=\"left-out\">Left out</h2>"));
}

// As of a scene that does not compute the best pose of an instance.
TEST_F(CliLeaderboard, SaysThatNobodyIsRanked) {
  evaluate("mine", {{"date", "9999-12-31"}});
  std::istringstream lines(place_.read("mine/results/trials/0000.jsonl"));
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    if (const std::size_t at = line.find("\"own_optimum_mse\":"); at != std::string::npos)
      line.replace(at, line.find(",\"own_optimum_pose\"") - at, "\"own_optimum_mse\":null");
    text += line + "\n";
  }
  place_.write("mine/results/trials/0000.jsonl", records::resealed(text));
  const Outcome built = relign_bench(place_, {"leaderboard", "build", "mine", "-o", "site"});
  EXPECT_EQ(built.exit_code, 4);
  EXPECT_THAT(built.err, AllOf(HasSubstr("no method of the round 'tiny' is ranked:\n  no trial has a normalised error"),
                               HasSubstr("the date '9999-12-31' is in the future")));
  EXPECT_THAT(place_.read("site/index.html"),
              AllOf(HasSubstr("No method of this round is ranked:"), HasSubstr("no trial has a normalised error")));
}

TEST_F(CliLeaderboard, LeavesOutRivalsMarkedAsOracles) {
  evaluate("mine");
  json manifest = json::parse(place_.read("mine/results/manifest.json"));
  manifest["algorithms"][0]["oracle"] = true;
  place_.write("mine/results/manifest.json", manifest.dump());
  const Outcome built = relign_bench(place_, {"leaderboard", "build", "mine", "-o", "site"});
  EXPECT_EQ(built.exit_code, 2);
  EXPECT_THAT(built.err, HasSubstr("is marked as an oracle"));
}

TEST_F(CliLeaderboard, RefusesUnknownBaselinesAndHiddenCharacters) {
  evaluate("mine");
  const auto build = [&](const std::string& option, const std::string& value) {
    return relign_bench(place_, {"leaderboard", "build", "mine", "-o", "site", option, value});
  };
  const Outcome unknown = build("--baseline", "nosuch");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--baseline: no evaluation has a method 'nosuch'; there are: "));
  for (const char* method : {"home", "nlopt-sbplx", "random"}) EXPECT_THAT(unknown.err, HasSubstr(method));
  for (const std::string hidden : {"\u202e", "\u200f", "\u2066", "\x1b[31m", "\n"}) {
    const Outcome title = build("--title", "Lens" + hidden + "lab");
    EXPECT_EQ(title.exit_code, 2);
    EXPECT_THAT(title.err, HasSubstr("--title: line ends, control characters and marks of the writing direction are"));
  }
  EXPECT_FALSE(fs::exists(place_.path("site")));
  EXPECT_EQ(build("--baseline", "nlopt-sbplx").exit_code, 0);
  EXPECT_THAT(place_.read("site/index.html"), HasSubstr("better than nlopt-sbplx"));
}

TEST_F(CliLeaderboard, LeavesOutResultsWithoutTheirSuite) {
  evaluate("mine");
  json manifest = json::parse(place_.read("mine/results/manifest.json"));
  manifest["suite"] = "";
  place_.write("mine/results/manifest.json", manifest.dump());
  const Outcome built = relign_bench(place_, {"leaderboard", "build", "mine", "-o", "site"});
  EXPECT_EQ(built.exit_code, 2);
  EXPECT_THAT(built.err, HasSubstr("lacks the text of its suite"));
  EXPECT_EQ(relign_bench(place_, {"report", "mine/results"}).exit_code, 0);
  EXPECT_THAT(place_.read("mine/results/report.html"), HasSubstr("manifest.json lacks the text of its suite"));
}

TEST_F(CliLeaderboard, ReadsNoLinkedSubmission) {
  evaluate("mine");
  place_.write("private", R"({"name": "secret"})");
  fs::remove(place_.path("mine/submission.json"));
  fs::create_symlink(place_.path("private"), place_.path("mine/submission.json"));
  const Outcome built = relign_bench(place_, {"leaderboard", "build", "mine", "-o", "site"});
  EXPECT_NE(built.exit_code, 0);
  EXPECT_THAT(built.err, HasSubstr("mine/submission.json' is a link"));
}

TEST_F(CliLeaderboard, ExplainsMistakes) {
  const Outcome none = relign_bench(place_, {"leaderboard", "build", "nowhere", "-o", "site"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, AllOf(HasSubstr("no evaluation can be shown"), HasSubstr("relign-bench submit evaluate")));
  EXPECT_FALSE(fs::exists(place_.path("site")));
  EXPECT_EQ(relign_bench(place_, {"leaderboard", "build"}).exit_code, 2);
}

}  // namespace
}  // namespace relign::cli_test
