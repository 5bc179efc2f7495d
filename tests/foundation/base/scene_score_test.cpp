#include "base/scene_score.h"

#include <gmock/gmock.h>

#include <limits>

#include "base/json_members.h"

namespace relign {
namespace {

using testing::HasSubstr;

const std::vector<Reading> kReadings = {{"power", "mW"}, {"loss", "dB"}};

struct ReadScore {
  SceneScore score;
  std::optional<std::size_t> measure;
  std::string problems;
};

ReadScore read(const std::string& score, const Measurements& measured = {kReadings}) {
  ReadScore found;
  std::vector<Problem> problems;
  const JsonSource source = JsonSource::from_text("{\"score\": " + score + "}", "description");
  found.score = read_scene_score(source, measured, found.measure, problems);
  for (const Problem& problem : problems) found.problems += problem.to_string() + "\n";
  return found;
}

TEST(SceneScore, OfImagesIsTheRootOfItsRecord) {
  EXPECT_EQ(SceneScore().shown(0.25), 0.5);
  EXPECT_EQ(SceneScore().shown(-1e-7), 0);
  EXPECT_TRUE(std::isnan(SceneScore().shown(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(SceneScore().label(), "RMSE");
}

TEST(SceneScore, ThatIsDeclaredIsItsRecord) {
  const ReadScore found =
      read(R"({"name": "insertion loss", "unit": "dB", "resolution": 0.01, "reading": "loss", "scale": "log"})");
  EXPECT_EQ(found.problems, "");
  EXPECT_EQ(found.score.shown(3.5), 3.5);
  EXPECT_EQ(found.score.shown(-1e-3), 0);
  EXPECT_TRUE(std::isnan(found.score.shown(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(found.score.label(), "insertion loss in dB");
  EXPECT_TRUE(found.score.logarithmic);
  EXPECT_EQ(found.measure, 1U);
}

TEST(SceneScore, IsMeasuredByAReadingBehindAnImage) {
  const Measurements both = {{{"power", "mW"}, {"visibility", ""}}, 1200};
  const ReadScore found = read(R"({"name": "1 - visibility", "resolution": 1e-5, "reading": "visibility"})", both);
  EXPECT_EQ(found.problems, "");
  EXPECT_EQ(found.measure, 1201U);
  EXPECT_THAT(read(R"({"name": "1 - visibility", "resolution": 1e-5})", both).problems,
              HasSubstr("missing key 'reading'"));
  const ReadScore of_image = read(R"({"name": "1 - visibility", "resolution": 1e-5})", {{}, 1200});
  EXPECT_EQ(of_image.problems, "");
  EXPECT_FALSE(of_image.measure) << "the RMSE measures it";
}

TEST(SceneScore, SurvivesTheManifest) {
  SceneScore score = read(R"({"name": "visibility below 1", "resolution": 0.001})", {}).score;
  EXPECT_EQ(read_described<SceneScore>(json_of(score), "a manifest"), score);
}

TEST(SceneScore, RefusesWhatItCannotJudgeBy) {
  EXPECT_THAT(read(R"({"unit": "dB"})").problems,
              testing::AllOf(HasSubstr("missing key 'name'"), HasSubstr("missing key 'resolution'"),
                             HasSubstr("missing key 'reading'")));
  EXPECT_THAT(read(R"({"name": "RMSE", "resolution": 1})", {}).problems, HasSubstr("other than 'RMSE'"));
  EXPECT_THAT(read(R"({"name": "loss", "resolution": 0})", {}).problems, HasSubstr("resolution"));
  EXPECT_THAT(read(R"({"name": "loss", "unit": "mW", "resolution": 1, "reading": "loss"})").problems,
              HasSubstr("is 'mW', but that of the reading 'loss' is 'dB'"));
  EXPECT_THAT(read(R"({"name": "loss", "unit": "dB", "resolution": 1, "reading": "los"})").problems,
              HasSubstr("found 'los'"));
  EXPECT_THAT(read(R"({"name": "loss", "resolution": 1, "scale": "dB"})", {}).problems,
              HasSubstr("expected 'linear' or 'log', found 'dB'"));
  EXPECT_THAT(read(R"({"name": "loss", "resolution": 1, "direction": "higher"})", {}).problems,
              HasSubstr("unknown key 'direction'"));
}

}  // namespace
}  // namespace relign
