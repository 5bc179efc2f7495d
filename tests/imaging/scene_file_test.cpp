#include "imaging/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "imaging/target.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

TEST(SceneFile, ThePapersNumbers) {
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

TEST(Target, SiemensStarOfThePaper) {
  const pixels::Image star = siemens_star(300);
  // 5 degrees above the row axis, to the right: white; 5 degrees below: black.
  EXPECT_EQ(star.at(280, 149 - 11), 1);
  EXPECT_EQ(star.at(280, 150 + 11), 0);
  double white = 0;
  for (const float value : star.values) white += static_cast<double>(value);
  EXPECT_NEAR(white / 90000, 0.5, 0.002);
  // Every ray through the centre meets opposite colours 10 degrees on, the same after 20.
  for (int degrees = 5; degrees < 360; degrees += 10) {
    const auto angle = optics::sine_cosine_of_degrees(degrees);
    const auto x = static_cast<std::size_t>(150 + 100 * angle.cosine);
    const auto y = static_cast<std::size_t>(150 - 100 * angle.sine);
    EXPECT_EQ(star.at(x, y), degrees / 10 % 2 == 0 ? 1 : 0) << degrees;
  }
}

}  // namespace
}  // namespace relign::imaging
