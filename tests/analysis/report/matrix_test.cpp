// The generalisation matrix on the page, in Markdown and in matrix.csv. Its numbers are tested in
// tests/analysis/statistics and by test_recompute.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "report/assets.h"
#include "report/made_results.h"
#include "report/made_statistics.h"
#include "report/matrix_data.h"
#include "report/page_json.h"
#include "report/report.h"
#include "report/written.h"

namespace relign::report {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class MatrixReport : public MadeResults {
 protected:
  // The errors are above an optimum of 0; the start is 0.05.
  static records::TrialRecord in_scene(const std::string& scene, const std::string& algorithm, std::uint64_t instance,
                                       const std::vector<double>& after, const std::string& level = "rho0") {
    std::vector<double> errors = after;
    errors.insert(errors.begin(), 0.05);
    records::TrialRecord record = trial(algorithm, instance, errors, level);
    record.scene = scene;
    record.trial = short_id(scene + level + algorithm + std::to_string(instance));
    record.own_optimum.mse = 0;
    return record;
  }
  // Falls to 0.003 by image 6 and to `last` by the last, image 8. The measured error is lowest at image 7, where the
  // error is 0.0015.
  static std::vector<double> descent(double last) { return {0.04, 0.03, 0.02, 0.01, 0.005, 0.003, 0.0015, last}; }

  void write_domains() {
    std::vector<records::TrialRecord> trials;
    for (const char* scene : {"doublet", "triplet"})
      for (const char* level : {"rho0", "rho0.5"})
        for (std::uint64_t i = 0; i < 7; ++i) {
          const double spread = 1e-5 * static_cast<double>(i);
          trials.push_back(in_scene(scene, "search", i, descent(0.02 + spread), level));
          trials.push_back(in_scene(scene, "policy", i, descent(0.001 + spread), level));
          trials.back().steps[7].measured = 0.001;
          if (i == 6 && scene[0] == 't') trials.back().end = "timeout";
        }
    write(trials);
  }
  PageModel data() { return page_model(load_results(folder_)); }
  static std::size_t occurrences(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  }
};

TEST_F(MatrixReport, SortsMethodsAndChoosesImages) {
  write_domains();
  const PageModel page = data();
  const Matrix matrix = matrix_of(page);
  ASSERT_EQ(matrix.parts.size(), 1U);
  const MatrixPart& part = matrix.parts[0];
  EXPECT_THAT(part.domains, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(matrix.images, ElementsAre(6));
  EXPECT_EQ(images_text(matrix, kLastImage), "8 (last)");
  EXPECT_EQ(matrix.scenes, 2U);
  ASSERT_EQ(part.rows.size(), 2U);
  EXPECT_EQ(part.rows[0].method->name, "policy");
  const Row& policy = *part.rows[0].cells[2];
  EXPECT_NEAR(excess_after(policy, 6, statistics::Rule::own)->median, 0.003, 1e-12);
  EXPECT_NEAR(excess_after(policy, kLastImage, statistics::Rule::own)->median, 0.001025, 1e-12) << "one of 7 failed";
  EXPECT_NEAR(excess_after(policy, kLastImage, statistics::Rule::best)->median, 0.0015, 1e-12);
  EXPECT_EQ(excess_after(policy, 12, statistics::Rule::own), nullptr);
  EXPECT_NEAR(page.groups[2].start_excess, 0.05, 1e-12);
}

TEST_F(MatrixReport, ClassesIncludeTheirLimits) {
  EXPECT_EQ(excess_class(0, kExcessClasses), 0);
  EXPECT_EQ(excess_class(0.0012, kExcessClasses), 0);
  EXPECT_EQ(excess_class(0.00121, kExcessClasses), 1);
  EXPECT_EQ(excess_class(0.01, kExcessClasses), 3);
  EXPECT_EQ(excess_class(0.011, kExcessClasses), 4);
  EXPECT_EQ(excess_class(std::nan(""), kExcessClasses), -1);
  EXPECT_EQ(excess_text(0.00001, SceneScore()), "<0.0001");
  EXPECT_EQ(excess_text(0.0001, SceneScore()), "0.000100");
}

TEST_F(MatrixReport, ShowsEveryNumberOfImagesAndRuleWithoutScripts) {
  write_domains();
  const std::string section = written(matrix_section, data());
  EXPECT_EQ(occurrences(section, "<table"), 6U) << "6 and 8 images, three rules";
  EXPECT_EQ(occurrences(section, "type=\"radio\""), 7U);
  EXPECT_EQ(occurrences(section, " checked"), 3U);
  for (const char* words : {"id=\"choice-i1\" class=\"i1\" checked", "id=\"choice-r0\" class=\"r0\" checked",
                            "id=\"choice-u1\" class=\"u1\" checked", "<caption>After 6 images, rule own</caption>",
                            "<span class=\"unit\">doublet</span>", "href=\"#group-3\"", "at most 0.0012</span>",
                            "above 20 %</span>", "not comparable in absolute terms", "0.00103*",
                            "6 of 7 instances, 1 trial failed", "(95 % interval), 7 instances"})
    EXPECT_THAT(section, HasSubstr(words)) << words;
  EXPECT_THAT(section, HasSubstr("<td class=\"a0 b0\"")) << "0.001 of 0.05";
  EXPECT_THAT(section, HasSubstr("<td class=\"a4 b4\"")) << "0.02 of 0.05";
  EXPECT_THAT(Report(folder_).html(),
              AllOf(HasSubstr("<section id=\"matrix\"><h2>Excess error by scene and noise level"),
                    Not(HasSubstr("Methods by scene and noise level"))));
}

TEST_F(MatrixReport, ColoursOneSceneByTheErrorItself) {
  std::vector<records::TrialRecord> trials;
  for (const char* level : {"rho0", "rho0.5"})
    for (const char* method : {"a", "b"}) trials.push_back(in_scene("doublet", method, 0, descent(0.001), level));
  write(trials);
  const std::string section = written(matrix_section, data());
  EXPECT_THAT(section, HasSubstr("class=\"u0\" checked"));
  EXPECT_THAT(section, HasSubstr("no interval, 1 instance"));
  EXPECT_THAT(section, Not(HasSubstr("not comparable")));
  EXPECT_THAT(section, Not(HasSubstr("class=\"unit\"")));
}

// Without intervals the tooltips name quartiles; without ground truth there is no matrix, and the heat map remains.
TEST_F(MatrixReport, NamesQuartilesAndMissingValues) {
  write_domains();
  PageModel page = data();
  for (Group& group : page.groups)
    for (Row& row : group.rows)
      for (ExcessAfter& after : row.excess) after.rules[statistics::Rule::best].interval = {};
  page.groups[0].rows[0].excess.erase(page.groups[0].rows[0].excess.begin());
  page.groups[1].rows[0].excess[0].rules[statistics::Rule::current] = {};
  page.groups[2].rows[0].excess.clear();
  page.groups[2].rows[0].trials = 0;
  const std::string section = written(matrix_section, page);
  for (const char* words :
       {"(quartiles)", "title=\"only 8 images\">-", "not recorded for this rule", "title=\"1 trial failed\">failed"})
    EXPECT_THAT(section, HasSubstr(words)) << words;
  for (Row& row : page.groups[3].rows) row.excess.clear();
  EXPECT_THAT(written(matrix_section, page), HasSubstr("Not shown: 1 group without known optima."));
  EXPECT_THAT(written(heat_section, page), HasSubstr("Methods by scene and noise level"));
  for (Group& group : page.groups)
    for (Row& row : group.rows) row.excess.clear();
  EXPECT_THAT(written(matrix_section, page), IsEmpty());
  EXPECT_THAT(matrix_markdown(page), IsEmpty());
}

// A method runs under its protocol only: one table each, instead of one with empty cells.
TEST_F(MatrixReport, HasATablePerProtocol) {
  std::vector<records::TrialRecord> trials;
  for (const char* level : {"rho0", "rho0.5"})
    for (const char* method : {"a", "b"})
      for (const char* protocol : {"paper", "blind"}) {
        trials.push_back(in_scene("doublet", method, 0, descent(0.001), level));
        trials.back().protocol = protocol;
        trials.back().trial = short_id(protocol + trials.back().trial);
      }
  write(trials);
  const std::string section = written(matrix_section, data());
  EXPECT_EQ(occurrences(section, "<table"), 12U) << "two protocols, two numbers of images, three rules";
  EXPECT_THAT(section, HasSubstr("Protocol blind, after the last image, rule best"));
  EXPECT_THAT(section, AllOf(Not(HasSubstr("<td></td>")), HasSubstr("<bdi>a</bdi>")));
  EXPECT_EQ(occurrences(matrix_markdown(data()), "| at the start |"), 2U);
}

TEST_F(MatrixReport, LimitsTheSizeOfThePage) {
  write_domains();
  PageModel page = data();
  const Method policy = page.methods[0];
  for (int more = 0; more < 1'000; ++more) {
    page.methods.push_back(policy);
    page.methods.back().label = "copy " + std::to_string(more);
  }
  const std::string section = written(matrix_section, page);
  EXPECT_EQ(occurrences(section, "<table"), 2U) << "two numbers of images, one rule";
  EXPECT_THAT(section, HasSubstr("This page is large; matrix.csv has the other rules."));
  EXPECT_EQ(occurrences(section, " checked"), 3U);
}

TEST_F(MatrixReport, TablesHaveTheNumbersOfTheModel) {
  write_domains();
  const PageModel page = data();
  Report(folder_).write_tables();
  const std::string csv = read_file(folder_ / "matrix.csv");
  EXPECT_EQ(csv, matrix_csv(page));
  EXPECT_EQ(occurrences(csv, "\n"), 1U + 4 * 2 * 2 * 3) << "groups, methods, numbers of images, rules";
  EXPECT_THAT(csv, HasSubstr("\ntriplet,rho0.5,paper,policy,merit,false,best,8,true,6,1,6,0.0015,0.0015,0.0015,0.0015,"
                             "0.0015,0.05,0.03\n"));
  const Json row = to_json(page)["groups"][3]["rows"][0];
  EXPECT_EQ(row["excess"][0]["images"], 6);
  EXPECT_EQ(row["excess"][1]["best"]["median"], 0.0015);
  EXPECT_EQ(to_json(page)["groups"][3]["start_excess"], 0.05);
  EXPECT_THAT(Report(folder_).markdown(),
              AllOf(HasSubstr("median after 6 / 8 (last) images"), HasSubstr("| at the start | 0.0500 | 0.0500 |"),
                    HasSubstr("| policy | 0.00300 / 0.00103 |")));
}

// WCAG 2.1: relative luminance of "#rrggbb".
double luminance(const std::string& colour) {
  double sum = 0;
  for (int channel = 0; channel < 3; ++channel) {
    const double value = std::stoi(colour.substr(static_cast<std::size_t>(1 + 2 * channel), 2), nullptr, 16) / 255.0;
    sum += std::array{0.2126, 0.7152, 0.0722}[static_cast<std::size_t>(channel)] *
           (value <= 0.03928 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4));
  }
  return sum;
}

TEST_F(MatrixReport, TextHasContrastInBothThemes) {
  const std::string css(assets::page_css());
  const auto colours = [&](const std::string& name) {
    std::vector<std::string> found;
    const std::regex definition("--" + name + ": (#[0-9a-f]{6});");
    for (std::sregex_iterator it(css.begin(), css.end(), definition), end; it != end; ++it) found.push_back((*it)[1]);
    return found;
  };
  const std::vector<std::string> ink = colours("ink");
  ASSERT_GE(ink.size(), 2U) << "light and dark";
  for (int shade = 0; shade < 5; ++shade) {
    const std::vector<std::string> back = colours("m" + std::to_string(shade));
    ASSERT_GE(back.size(), 2U);
    for (std::size_t theme = 0; theme < 2; ++theme) {
      const double a = luminance(ink[theme]) + 0.05, b = luminance(back[theme]) + 0.05;
      EXPECT_GE(std::max(a, b) / std::min(a, b), 4.5) << ink[theme] << " on " << back[theme];
    }
  }
}

}  // namespace
}  // namespace relign::report
