// What pages call the devices and captures of scenes.
#include "report/scene_words.h"

#include <gmock/gmock.h>

#include "report/made_results.h"
#include "report/report.h"

namespace relign::report {
namespace {

using testing::HasSubstr;
using testing::Not;

const Json kImage = {{"image", {{"width", 20}, {"height", 10}}}};
const Json kReadings = {{"readings", {{{"name", "loss"}, {"unit", "dB"}}}}};

Json both() {
  Json description = kImage;
  description.update(kReadings);
  return description;
}

SceneScore declared() {
  SceneScore score;
  score.name = "loss", score.unit = "dB", score.squared = false;
  return score;
}

TEST(SceneWords, FollowTheDescriptionAndTheScore) {
  EXPECT_EQ(words_of(Json(), SceneScore()), SceneWords()) << "no description";
  EXPECT_EQ(words_of(kImage, SceneScore()), SceneWords());
  EXPECT_EQ(words_of(kImage, declared()), (SceneWords{"device", "devices", "image", "image"}));
  EXPECT_EQ(words_of(kReadings, declared()), (SceneWords{"device", "devices", "reading", "move"}));
  EXPECT_EQ(words_of(both(), declared()), (SceneWords{"device", "devices", "capture", "move"}));
}

TEST(SceneWords, AreNeutralWhereScenesDiffer) {
  const SceneWords lens, reads = words_of(kReadings, declared());
  EXPECT_EQ(common_words(lens, lens), lens);
  EXPECT_EQ(common_words(reads, reads), reads);
  for (const SceneWords& mixed : {common_words(lens, reads), common_words(reads, lens)})
    EXPECT_EQ(mixed, (SceneWords{"device", "devices", "capture", "move"}));
}

TEST(SceneWords, CountFromTheStart) {
  const SceneWords lens, reads = words_of(kReadings, declared());
  EXPECT_EQ(lens.until(68), "69 images (the one at the start included)");
  EXPECT_EQ(lens.until(0), "1 image (the one at the start)");
  EXPECT_EQ(reads.until(68), "68 moves");
  EXPECT_EQ(reads.until(1), "1 move");
}

TEST(SceneWords, NameWhatMethodsObserve) {
  const std::string title = "Methods that observe images and the design";
  EXPECT_EQ(SceneWords().observed(title), title);
  EXPECT_EQ(words_of(kReadings, declared()).observed(title), "Methods that observe all readings and the design");
  EXPECT_EQ(words_of(both(), declared()).observed("merit, images, box"), "merit, captures, box");
  EXPECT_EQ(words_of(kReadings, declared()).observed("merit"), "merit");
}

// Two scenes on a page: one with a lens, one with this description.
class SceneWordsOnPages : public MadeResults {
 protected:
  std::string page(const Json& second) {
    std::vector<records::TrialRecord> trials = {trial("a", 0, {0.1, 0.05}), trial("b", 0, {0.1, 0.09})};
    for (const char* method : {"a", "b"}) {
      trials.push_back(trial(method, 0, {0.1, 0.05}, "near"));
      trials.back().scene = "fibre";
    }
    write(trials);
    Json score = json_of(declared());
    add_to_manifest({{"scenes",
                      {{{"name", "relign_od"}, {"id", "relign_od"}, {"folder", "scenes/1"}},
                       {{"name", "fibre"}, {"id", "fibre"}, {"folder", "scenes/2"}, {"score", score}}}}});
    write_file_atomically(folder_ / "scenes/1/description.json", kImage.dump());
    write_file_atomically(folder_ / "scenes/2/description.json", second.dump());
    return Report(folder_).html();
  }
};

TEST_F(SceneWordsOnPages, DifferByGroupAndAreNeutralInCommonTexts) {
  const std::string mixed = page(kReadings);
  for (const char* words :
       {"Each step is one move and one capture.", "A step is one move and one capture", "\"counted\":\"move\""})
    EXPECT_THAT(mixed, HasSubstr(words)) << words;
  EXPECT_THAT(page(kImage), Not(HasSubstr("\"counted\"")));
}

}  // namespace
}  // namespace relign::report
