// The page as text: escaping, policy, missing parts, size. browser_test.cpp tests it in a browser.
#include "report/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "base/files.h"
#include "records/picture_index.h"
#include "report/made_results.h"
#include "report/report.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

// The page without its own scripts and styles, which may contain any characters.
std::string without_scripts_and_styles(std::string page) {
  for (const char* tag : {"script", "style"}) {
    const std::string open = std::string("<") + tag, close = std::string("</") + tag + ">";
    for (std::size_t at = page.find(open); at != std::string::npos; at = page.find(open, at)) {
      const std::size_t end = page.find(close, at);
      if (end == std::string::npos) break;
      page.erase(at, end + close.size() - at);
    }
  }
  return page;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

using Page = MadeResults;

TEST_F(Page, StationPagesMentionNoGroundTruthOrEqualInstances) {
  write({on_station("a", {0.2, 0.15}), on_station("b", {0.12, 0.3})});
  add_to_manifest({{"suite", R"({"scenes": ["bench"]})"}, {"scenes", {{{"name", "bench"}, {"owns_stage", true}}}}});
  const std::string station = without_scripts_and_styles(Report(folder_).html());
  EXPECT_THAT(station, HasSubstr("lens, start pose and stage are real"));
  EXPECT_THAT(station, HasSubstr("lowest measured error"));
  for (const char* word : {"were given the same instances", "final error", "last commanded pose", "noise level",
                           "without camera noise", "Simulated travel"})
    EXPECT_THAT(station, Not(HasSubstr(word))) << word;

  // With a simulated scene as well, the page explains both.
  write({on_station("a", {0.2, 0.15}), trial("a", 0, {0.1, 0.05})});
  add_to_manifest({{"suite", R"({"scenes": ["bench", "relign_od"]})"},
                   {"scenes", {{{"name", "bench"}, {"owns_stage", true}}, {{"name", "relign_od"}}}}});
  const std::string both = without_scripts_and_styles(Report(folder_).html());
  for (const char* word : {"lens, start pose and stage are real", "were given the same instances", "final error",
                           "last commanded pose", "without camera noise"})
    EXPECT_THAT(both, HasSubstr(word)) << word;
}

TEST_F(Page, MergedFoldersListSourcesAndDifferences) {
  write({trial("a", 0, {0.1, 0.05})});
  add_to_manifest(
      {{"sources", {{{"folder", "ours<b>"}, {"trials", 1}, {"machine", {{"cpu", "Abacus"}}}}}},
       {"merge",
        {{"disagreeing", 1},
         {"disagreements",
          {{{"label", "a on toy #0"},
            {"kept", "ours"},
            {"other", "theirs"},
            {"difference",
             {{"line", "step"}, {"step", 3}, {"field", "measured"}, {"kept", "0.1"}, {"other", "0.2"}}}}}}}}});
  const std::string page = without_scripts_and_styles(Report(folder_).html());
  for (const char* word :
       {"Merged from 1 results folder", "Not reproducible", "1 trial with different results in two of these folders",
        "step 3, measured is 0.1 in ours, 0.2 in theirs", "Abacus", "ours&lt;b&gt;"})
    EXPECT_THAT(page, HasSubstr(word)) << word;
}

TEST_F(Page, EscapesAllText) {
  records::TrialRecord failed = trial(kHostile, 1, {0.1}, kHostile);
  failed.end = "failed";
  failed.message = failed.scene = failed.algorithm_id = kHostile;
  records::TrialRecord warned = trial(kHostile, 2, {0.1, 0.05}, kHostile);
  warned.warnings = {kHostile};
  warned.scene = failed.scene;
  write({trial(kHostile, 0, {0.1, 0.05}, kHostile), failed, warned}, kHostile);
  Json manifest = Json::parse(read_file(folder_ / "manifest.json"));
  for (const char* key : {"suite_file", "command", "instance_set"}) manifest[key] = kHostile;
  manifest["suite"] = Json({{"name", kHostile}}).dump();
  for (const char* key : {"version", "compiler", "flags", "hash"}) manifest["program"][key] = kHostile;
  for (const char* key : {"cpu", "system"}) manifest["machine"][key] = kHostile;
  for (const char* key : {"id", "plugin", "summary", "merit", "plugin_hash"}) manifest["algorithms"][0][key] = kHostile;
  manifest["algorithms"][0]["observes"] = {kHostile};
  manifest["algorithms"][0]["parameters"] = {{kHostile, kHostile}};
  write_file_atomically(folder_ / "manifest.json", manifest.dump());
  records::PictureIndex index;
  index.references = {{kHostile, kHostile}};
  records::PicturedTrial& pictured = index.trials.emplace_back();
  pictured.trial = pictured.scene = pictured.noise_level = pictured.algorithm = kHostile;
  pictured.why = "median";
  pictured.frames = {{0, kHostile}};
  records::write_picture_index(folder_, index);

  const std::string page = Report(folder_).html();
  EXPECT_EQ(count(page, "<script"), count(page, "<script>") + 1) << "the scripts and the data";
  EXPECT_EQ(count(page, "</script"), count(page, "<script"));
  const std::string markup = without_scripts_and_styles(page);
  EXPECT_THAT(markup, Not(HasSubstr("<img")));
  EXPECT_THAT(markup, Not(HasSubstr("alert(1)>")));
  const std::string tags = std::regex_replace(markup, std::regex("\"[^\"]*\""), "");
  EXPECT_FALSE(std::regex_search(tags, std::regex("<[^>]*\\sonerror"))) << "no attribute broke out";
  EXPECT_THAT(page, Not(HasSubstr("\x1b")));
  EXPECT_GT(count(markup, "&quot;&gt;&lt;img src=x onerror=alert(1)&gt;&lt;/script&gt;"), 15u) << "shown, but escaped";
  EXPECT_GT(count(markup, "{{data}}"), 15u) << "and not replaced as part of the template";
}

TEST_F(Page, PolicyAllowsOnlyItsOwnScripts) {
  write({trial("a", 0, {0.1, 0.05})});
  const std::string page = Report(folder_).html();
  std::smatch policy;
  ASSERT_TRUE(std::regex_search(page, policy, std::regex("Content-Security-Policy\" content=\"([^\"]*)\"")));
  EXPECT_THAT(policy[1].str(), HasSubstr("default-src 'none'"));
  const std::string sources = policy[1].str().substr(policy[1].str().find("script-src"));
  EXPECT_THAT(sources, Not(HasSubstr("unsafe")));
  EXPECT_EQ(count(sources, "'sha256-"), 1u);
  // Whatever the markup loads is inside the page.
  const std::string markup = without_scripts_and_styles(page);
  const std::regex reference("\\s(?:src|href|srcset|action|data)=\"([^\"]*)\"");
  for (std::sregex_iterator it(markup.begin(), markup.end(), reference), end; it != end; ++it)
    EXPECT_TRUE((*it)[1].str().rfind("data:", 0) == 0 || (*it)[1].str()[0] == '#') << (*it)[1];
  EXPECT_THAT(page, Not(HasSubstr("sourceMappingURL")));
  EXPECT_THAT(page, Not(HasSubstr("@import")));
  EXPECT_THAT(page, Not(HasSubstr("url(")));
}

TEST_F(Page, ReportsThatNothingHasFinished) {
  write({}, "made", 5);
  std::string page = Report(folder_).html();
  EXPECT_THAT(page, HasSubstr("0/5 trials ran"));
  EXPECT_THAT(page, HasSubstr("No trial of this run has finished yet"));
  write({}, "made", 0);
  EXPECT_THAT(Report(folder_).html(), HasSubstr("This results folder contains no trials"));
}

TEST_F(Page, ShowsFailuresAndTheirMessages) {
  records::TrialRecord failed = trial("broken", 3, {0.1, 0.2});
  failed.end = "failed";
  failed.message = "the stride is NaN";
  write({trial("good", 3, {0.1, 0.05}), failed}, "made", 2);
  const std::string page = Report(folder_).html();
  EXPECT_THAT(page, HasSubstr("1/4 trials ran"));
  EXPECT_THAT(page, HasSubstr("1 failed: broken"));
  EXPECT_THAT(page, HasSubstr("the stride is NaN"));
  EXPECT_THAT(page, HasSubstr("rho0 instance 3 after 1 step "));
  EXPECT_THAT(page, HasSubstr("2 trials not finished"));
  EXPECT_THAT(page, HasSubstr("Run the same command again to resume."));
}

// Three levels, five methods, ten instances, 30 steps, pictures up to their limit.
TEST_F(Page, QuickSuitePageIsUnderSevenHundredKilobytes) {
  std::vector<records::TrialRecord> trials;
  for (const char* level : {"rho0", "rho0.25", "rho0.5"})
    for (const char* method : {"home", "random", "nlopt-sbplx", "nlopt-bobyqa", "compass"})
      for (std::uint64_t i = 0; i < 10; ++i) {
        std::vector<double> errors;
        for (int step = 0; step <= 30; ++step)
          errors.push_back(0.0123456789 + 0.0987654321 / (1 + step + static_cast<double>(i)));
        trials.push_back(trial(method, i, errors, level));
      }
  write(trials);
  const std::size_t bare = Report(folder_).html().size();
  EXPECT_LT(bare + kMaxPictureBytes, 700'000u);
  Report(folder_).write_html(folder_ / "report.html");
  EXPECT_EQ(fs::file_size(folder_ / "report.html"), bare);
}

TEST(PageTemplate, DoesNotExpandInsertedText) {
  EXPECT_EQ(filled("<{{a}}|{{b}}>", {{"a", "{{b}}"}, {"b", "B"}}), "<{{b}}|B>");
  EXPECT_THROW(filled("{{unknown}}", {}), std::exception);
  EXPECT_THROW(filled("{{open", {}), std::exception);
}

}  // namespace
}  // namespace relign::report
