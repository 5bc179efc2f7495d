#include "leaderboard/evaluation.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "leaderboard/made_evaluations.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

class EvaluationFile : public MadeEvaluations {
 protected:
  std::string error_with(const Json& change) {
    evaluation("e", {{"mine", {"merit"}, 0.1, true}}, change);
    return error_text(ErrorKind::bad_input, [&] { read_evaluation(folder_ / "e"); });
  }
};

TEST_F(EvaluationFile, IsReadAndWrittenAlike) {
  const fs::path folder = evaluation("e", {{"mine", {"merit", "box"}, 0.1, true}, random()});
  const Evaluation read = read_evaluation(folder);
  EXPECT_EQ(read.name, "mine");
  EXPECT_EQ(read.suite.instance_set, "set-1");
  EXPECT_THAT(read.observes, ElementsAre("box", "merit")) << "sorted";
  ASSERT_EQ(read.methods.size(), 2U);
  EXPECT_TRUE(read.methods[0].submitted);
  EXPECT_EQ(read.steps, 2U);
  EXPECT_EQ(read.results_folder(), folder / "results");
  write_file_atomically(folder / "evaluation.json", to_json(read).dump());
  EXPECT_EQ(to_json(read_evaluation(folder)), to_json(read));
}

TEST_F(EvaluationFile, ReadsCostsOfTraining) {
  const auto training = [&](const Json& value) {
    evaluation("e", {{"mine", {"merit"}, 0.1, true}});
    Json file = Json::parse(read_file(folder_ / "e/evaluation.json"));
    file["methods"][0]["training"] = value;
    write_file_atomically(folder_ / "e/evaluation.json", file.dump());
    return read_evaluation(folder_ / "e").methods[0].training;
  };
  const auto full = training({{"steps", nullptr}, {"images", 1e6}, {"hours", 1.5}, {"hardware", "one core"}});
  ASSERT_TRUE(full);
  EXPECT_TRUE(std::isnan(full->steps));
  EXPECT_EQ(full->images, 1e6);
  EXPECT_EQ(full->hours, 1.5);
  EXPECT_EQ(full->hardware, "one core");
  EXPECT_EQ(training({{"hours", 1}, {"machine", "as in manifests"}})->hardware, "as in manifests");
  EXPECT_FALSE(training(nullptr));
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [&] {
                           training({{"hours", -1}});
                         }),
              HasSubstr("/methods/0/training/hours"));
}

// A mark of the writing direction shows 'evil' as another name, and a line end fakes a line of the terminal.
TEST_F(EvaluationFile, RefusesHiddenCharactersInEveryTextOfThePages) {
  const std::string sentence = ": line ends, control characters and marks of the writing direction are not allowed";
  for (const std::string hidden : {"\u202e", "\u2066", "\u200f", "\u0085", "\x1b", "\n"}) {
    EXPECT_THAT(error_with({{"suite", {{"name", "made" + hidden}}}}), HasSubstr("/suite/name" + sentence));
    EXPECT_THAT(error_with({{"program_version", hidden}}), HasSubstr("/program_version" + sentence));
    EXPECT_THAT(error_with({{"class", {"merit", hidden}}}), HasSubstr("/class/1" + sentence));
    EXPECT_THAT(error_with({{"date", "2026-11-24T" + hidden}}), HasSubstr("/date" + sentence));
  }
  const fs::path folder = evaluation("e", {{"mine", {"merit"}, 0.1, true}});
  const Json honest = Json::parse(read_file(folder / "submission.json"));
  for (const char* key : {"name", "version", "summary", "authors", "licence", "citation", "homepage"}) {
    Json file = honest;
    file[key] = std::string(key) == "authors" ? Json({"A. Tester", "B\u202e"}) : Json("x\u200f");
    write_file_atomically(folder / "submission.json", file.dump());
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_submission(folder); }),
                HasSubstr("/" + std::string(key) + (std::string(key) == "authors" ? "/1" : "") + sentence));
  }
}

TEST_F(EvaluationFile, RefusesMistakesWithTheirPlace) {
  EXPECT_THAT(error_with({{"format", "relign-bench/evaluation/2"}}), HasSubstr("a newer version of relign-bench"));
  EXPECT_THAT(error_with({{"archive_sha256", "ABC"}}), HasSubstr("expected 64 lower-case hexadecimal digits"));
  EXPECT_THAT(error_with({{"date", "24.11.2026"}}), HasSubstr("found '24.11.2026'"));
  EXPECT_THAT(error_with({{"date", "2026-99-99"}}), HasSubstr("found '2026-99-99'"));
  EXPECT_THAT(error_with({{"date", "2026-02-29"}}), HasSubstr("found '2026-02-29'")) << "2026 is not a leap year";
  EXPECT_THAT(error_with({{"sealed", nullptr}}), HasSubstr("missing key 'sealed'"));
  EXPECT_THAT(error_with({{"sandbox", "yes"}}), HasSubstr("/sandbox"));
  EXPECT_THAT(error_with({{"methods", Json::array()}}), HasSubstr("at least one method"));
  EXPECT_THAT(error_with({{"name", ""}}), HasSubstr("/name"));
  EXPECT_THAT(error_with({{"budget", {{"steps", -1}}}}), HasSubstr("/budget/steps"));
  EXPECT_THAT(error_with({{"surprise", 1}}), HasSubstr("unknown key 'surprise'"));
}

TEST_F(EvaluationFile, ReadsNoLinks) {
  write_file_atomically(folder_ / "private", "{\"secret\": 1}");
  const std::filesystem::path e = evaluation("e", {{"mine", {"merit"}, 0.1, true}});
  for (const char* name : {"submission.json", "evaluation.json"}) {
    std::filesystem::remove(e / name);
    std::filesystem::create_symlink(folder_ / "private", e / name);
  }
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_submission(e); }),
              testing::AllOf(HasSubstr("is a link"), testing::Not(HasSubstr("secret"))));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_evaluation(e); }), HasSubstr("is a link"));
}

TEST_F(EvaluationFile, ReadsNoResultsOutsideTheFolder) {
  for (const char* name : {"..", ".", "", "../other", "/etc", "a/b"})
    EXPECT_THAT(error_with({{"results", name}}), HasSubstr("expected the name of a folder beside this file")) << name;
}

TEST_F(EvaluationFile, RefusesOtherFoldersAndHugeFiles) {
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_evaluation(folder_ / "none"); }),
              HasSubstr("is not an evaluation folder"));
  evaluation("e", {{"mine", {"merit"}, 0.1, true}});
  write_file_atomically(folder_ / "e/submission.json", std::string(kMaxEvaluationBytes + 1, ' '));
  EXPECT_NE(error_text(ErrorKind::bad_input, [&] { read_submission(folder_ / "e"); }), "");
}

}  // namespace
}  // namespace relign::leaderboard
