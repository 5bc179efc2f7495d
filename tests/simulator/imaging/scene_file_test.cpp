#include "imaging/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "error_text.h"
#include "imaging/target.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

TEST(SceneFile, MatchesThePapersNumbers) {
  const SceneFile& scene = relign_od_scene();
  EXPECT_EQ(scene.name, "relign_od");
  EXPECT_EQ(scene.sensor.z_mm, 12.0166695);
  EXPECT_EQ(scene.axes(), 5u);
  // First vertex in world coordinates at the nominal pose.
  EXPECT_NEAR(scene.lens_to_world(nominal_pose()).point({0, 0, 0}).z, -8.5708805, 1e-12);
}

TEST(SceneFile, PosesMoveTheLensAboutThePivot) {
  const SceneFile& scene = relign_od_scene();
  const optics::Vec3 pivot{0, 0, scene.pivot_behind_first_vertex_mm};
  const optics::Vec3 moved = scene.lens_to_world({1, 0.25, 0.5, 0.9, 0.1}).point(pivot);
  EXPECT_NEAR(moved.x, 1, 1e-12);
  EXPECT_NEAR(moved.y, -0.5, 1e-12);
  EXPECT_NEAR(moved.z, 0, 1e-12);
  // +Rx lowers... a point behind the pivot (towards +z) moves to -y.
  const optics::Vec3 behind =
      scene.lens_to_world({0.5, 0.5, 0.5, 1, 0.5}).point({0, 0, scene.pivot_behind_first_vertex_mm + 1});
  EXPECT_NEAR(behind.y, -0.12186934, 1e-7);
}

TEST(SceneFile, AmbientIndexDividesTheGlass) {
  SceneChoices choices;
  choices.ambient_index = 1.000277;
  const SceneFile scene = relign_od_scene_with(choices);
  EXPECT_NEAR(scene.lens.elements[0].faces[0].index_after, 1.487027, 1e-6);
  EXPECT_EQ(scene.lens.elements[0].faces[1].index_after, 1);
}

TEST(SceneFile, ShowsTheChosenTarget) {
  SceneChoices choices;
  choices.target = "chessboard:fields=4";
  const SceneFile scene = relign_od_scene_with(choices);
  EXPECT_EQ(scene.emitter.radiance.values, draw_target("chessboard:fields=4", 1200)->values);
  EXPECT_EQ(scene.emitter.target, "chessboard:fields=4");
  EXPECT_EQ(scene.files, relign_od_scene().files) << "a drawn target does not add a file";
  choices.target = "chesboard";
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { read_scene_file(relign_od_file(), choices); }),
              testing::HasSubstr("did you mean 'chessboard'"));
}

TEST(SceneFile, ReportsUnknownTargetWithPosition) {
  std::string text = read_file(relign_od_file());
  text.replace(text.find("siemens_star"), 12, "white:x=1");
  const std::filesystem::path file = testing::TempDir() + "scene_file_test_target.json";
  write_file_atomically(file, text);
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { read_scene_file(file, {}); }),
              testing::AllOf(testing::HasSubstr("scene_file_test_target.json:"),
                             testing::HasSubstr("unknown parameter 'x' of target 'white'; it has none")));
}

TEST(SceneFile, ReportsWhatSuitesRejectWithPosition) {
  const std::string text = read_file(relign_od_file());
  const std::filesystem::path file = testing::TempDir() + "scene_file_test_keys.json";
  const auto mistake = [&](const char* key, const std::string& value) {
    Json scene = Json::parse(text);
    scene[key] = Json::parse(value);
    write_file_atomically(file, scene.dump(1));
    return test::error_text(ErrorKind::bad_input, [&] { read_scene_file(file, {}); });
  };
  EXPECT_THAT(mistake("spec", R"({"rsme": 0.1})"), testing::AllOf(testing::HasSubstr("scene_file_test_keys.json:"),
                                                                  testing::HasSubstr("did you mean 'rmse'?")));
  EXPECT_THAT(mistake("spec", R"({"rmse": "0.01"})"), testing::HasSubstr("/spec/rmse: expected a number"));
  EXPECT_THAT(mistake("spec", R"({"rmse": -1})"), testing::HasSubstr("/spec/rmse"));
  EXPECT_THAT(mistake("spec", R"({"mtf": {"lp_per_mm": 20, "center": 0.6}})"),
              testing::HasSubstr("did you mean 'centre'?"));
  EXPECT_THAT(mistake("machine_time", R"({"speed_mm_s": 3})"),
              testing::AllOf(testing::HasSubstr("scene_file_test_keys.json:"),
                             testing::HasSubstr("/machine_time/speed_mm_s: unknown key")));
}

}  // namespace
}  // namespace relign::imaging
