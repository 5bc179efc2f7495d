// Several results folders on one page.
#include "report/several_folders.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "base/error.h"
#include "report/made_pictures.h"
#include "report/report.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class SeveralFolders : public MadePictures {
 protected:
  // Two methods on `instances` instances, in a folder of its own.
  fs::path made(const std::string& name, const std::string& set, const std::string& method, double error,
                const Json& more = Json::object(), std::uint64_t instances = 3) {
    const fs::path above = folder_;
    folder_ = above / name;
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < instances; ++i) {
      trials.push_back(trial(method, i, {0.2, 2 * error, error}));
      trials.push_back(trial("home", i, {0.2, 0.1, 0.1}));
      for (std::size_t k = trials.size() - 2; k < trials.size(); ++k)
        trials[k].trial = short_id(set + trials[k].trial + (trials[k].algorithm == "home" ? "" : name));
    }
    write(trials, "suite of " + set);
    add_to_manifest({{"instance_set", set},
                     {"scenes", {scene()}},
                     {"noise_levels", {{{"name", "rho0"}}}},
                     {"algorithms", {algorithm(method), algorithm("home")}}});
    add_to_manifest(more);
    const fs::path written = folder_;
    folder_ = above;
    return written;
  }
  static Json scene() { return {{"name", "relign_od"}, {"folder", "scenes/1f"}}; }
  static Json algorithm(const std::string& name, const Json& parameters = Json::object()) {
    return {{"name", name}, {"id", name}, {"protocol", "paper"}, {"parameters", parameters}};
  }
  static std::vector<std::string> methods_of(const Json& group) {
    std::vector<std::string> names;
    for (const Json& row : group["rows"]) names.push_back(row["method"]);
    return names;
  }
  static std::string error_of(const std::vector<fs::path>& folders) {
    try {
      Report report(folders);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  }
};

TEST_F(SeveralFolders, CompareTheSameInstancesInOneGroup) {
  const fs::path ours = made("ours", "set A", "compass", 0.01), theirs = made("theirs", "set A", "sbplx", 0.02);
  const Report report({ours, theirs});
  const Json data = report.json();
  ASSERT_EQ(data["groups"].size(), 1U);
  EXPECT_THAT(methods_of(data["groups"][0]), ElementsAre("compass", "sbplx", "home"));
  EXPECT_EQ(data["ran"]["planned"], 9) << "the trials of home are the same in both";
  EXPECT_TRUE(report.model().parts.empty());
  const std::string page = report.html();
  EXPECT_THAT(page, AllOf(HasSubstr("Merged from 2 results folders"),
                          HasSubstr("The results folders contain the same numbers")));
  // The folders are unchanged.
  EXPECT_FALSE(fs::exists(ours / "report.html"));
  EXPECT_FALSE(fs::exists(ours / "curves.csv"));
}

TEST_F(SeveralFolders, RemoveTheTemporaryFolder) {
  const fs::path ours = made("ours", "set A", "compass", 0.01), theirs = made("theirs", "set A", "sbplx", 0.02);
  // A folder of its own, because other tests make reports at the same time.
  const fs::path temporary = folder_ / "temporary";
  fs::create_directory(temporary);
  const char* const given = std::getenv("TMPDIR");
  const std::string before = given ? given : "";
  ::setenv("TMPDIR", temporary.c_str(), 1);
  { EXPECT_THAT(Report({ours, theirs}).html(), HasSubstr("sbplx")); }
  if (given)
    ::setenv("TMPDIR", before.c_str(), 1);
  else
    ::unsetenv("TMPDIR");
  EXPECT_TRUE(fs::is_empty(temporary));
}

TEST_F(SeveralFolders, HaveSeparateGroupsForOtherInstances) {
  const fs::path first = made("first", "set A", "compass", 0.01), second = made("second", "set B", "compass", 0.02);
  const Report report({first, second});
  const Json data = report.json();
  ASSERT_EQ(data["groups"].size(), 2U);
  EXPECT_EQ(data["groups"][0]["label"], "first: rho0");
  EXPECT_EQ(data["groups"][1]["label"], "second: rho0");
  EXPECT_EQ(data["groups"][1]["rows"][0]["recommended"]["median"], 0.02);
  EXPECT_EQ(data["ran"]["finished"], 12);
  EXPECT_EQ(data["methods"].size(), 2U) << "one colour per name on the page";
  const std::string page = report.html();
  for (const char* words : {"first: rho0", "second: rho0", "2 instance sets", "suite of set A, suite of set B",
                            "From folders with different instances", "Within a folder, all methods"})
    EXPECT_THAT(page, HasSubstr(words)) << words;
  EXPECT_THAT(page, Not(HasSubstr("instances each")));
  // Three folders, two of them one set.
  const Report three({first, second, made("third", "set A", "sbplx", 0.005)});
  ASSERT_EQ(three.json()["groups"].size(), 2U);
  EXPECT_EQ(three.json()["groups"][0]["label"], "first and 1 more: rho0");
  EXPECT_THAT(methods_of(three.json()["groups"][0]), ElementsAre("sbplx", "compass", "home"));
}

TEST_F(SeveralFolders, KeepThePicturesOfEach) {
  const fs::path above = folder_;
  std::vector<fs::path> folders;
  for (const char* name : {"first", "second"}) {
    folders.push_back(made(name, name, "compass", 0.01));
    folder_ = folders.back();
    put("end.png", made_png(name));
    write_index(Json::array({entry("compass", "median", "end.png", "end.png")}),
                Json::array({{{"scene", "relign_od"}, {"file", "end.png"}}}));
    folder_ = above;
  }
  const std::string page = Report(folders).html();
  EXPECT_THAT(page, AllOf(HasSubstr("id=\"picture-0\""), HasSubstr("id=\"picture-1\"")));
  EXPECT_THAT(page, AllOf(HasSubstr("href=\"#picture-0\""), HasSubstr("href=\"#picture-1\"")));
}

TEST_F(SeveralFolders, RejectOneNameForTwoMethods) {
  const Json narrow = {{"algorithms", {algorithm("compass", {{"stride", 0.1}}), algorithm("home")}}};
  const Json wide = {{"algorithms", {algorithm("compass", {{"stride", 0.3}}), algorithm("home")}}};
  const fs::path first = made("first", "set A", "compass", 0.01, narrow);
  EXPECT_THAT(error_of({first, made("second", "set B", "compass", 0.02, wide)}),
              AllOf(HasSubstr("'compass'"), HasSubstr("first"), HasSubstr("second"), HasSubstr("in its parameters"),
                    HasSubstr("another 'name'")));
  const auto with_model = [](const char* file) {
    return Json{{"algorithms", {algorithm("compass", {{"model", file}}), algorithm("home")}}};
  };
  EXPECT_THAT(error_of({made("third", "set A", "compass", 0.01, with_model("a.onnx (sha256:01)")),
                        made("fourth", "set B", "compass", 0.02, with_model("a.onnx (sha256:02)"))}),
              HasSubstr("in its parameters"))
      << "files of the same name with different content";
  // Within one instance set the rules of merge apply.
  EXPECT_NE(error_of({first, made("fifth", "set A", "compass", 0.02, wide)}), "none");
}

TEST_F(SeveralFolders, HaveUniqueLabels) {
  const fs::path a = made("a/quick", "set A", "compass", 0.01), b = made("b/quick", "set B", "compass", 0.02);
  const std::vector<FolderSet> sets = folder_sets({a, b, a / "."});
  ASSERT_EQ(sets.size(), 2U) << "duplicates are removed";
  EXPECT_EQ(sets[0].label, a.string());
  EXPECT_EQ(sets[1].label, b.string());
  EXPECT_EQ(folder_sets({a}).front().label, "quick");
  EXPECT_THAT(error_of({a, folder_ / "nowhere"}), HasSubstr("no such folder"));
  fs::create_directories(folder_ / "empty");
  EXPECT_THAT(error_of({a, folder_ / "empty"}), HasSubstr("is not a results folder"));
}

}  // namespace
}  // namespace relign::report
