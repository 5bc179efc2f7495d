// A lens or scene file must not take the machine: memory and work are bounded by counts, whatever its numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/files.h"
#include "error_text.h"
#include "images/measures.h"
#include "optics/pupil_search.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr int kMostPlaces = optics::PlaceRange().most_places;

// The paper's lens, with the image plane of its file `gap_mm` behind the last face: the plane of importance regions is
// then as close to the image as in a lens with a cover plate on the sensor.
SceneFile with_image_behind(double gap_mm) {
  SceneFile scene = relign_od_scene();
  scene.lens.image_z_mm = scene.lens.elements.back().faces.back().z_mm + gap_mm;
  scene.pupil = std::make_shared<optics::PupilSearch>(search_pupil(scene, scene.lens));
  return scene;
}

TEST(Bounds, PlaneCloseToTheImageNeedsFewRegions) {
  for (const double gap_mm : {0.11, 1e-3, 1e-12, 0.0, -1.0}) {
    const optics::PassingGrid& grid = with_image_behind(gap_mm).pupil->grid();
    EXPECT_FALSE(grid.on_plane) << gap_mm;
    EXPECT_LE(grid.places(), 10000) << gap_mm;
  }
  EXPECT_TRUE(with_image_behind(3).pupil->grid().on_plane);
}

TEST(Bounds, RegionsOfSuchALensMissNoLight) {
  const SceneFile close = with_image_behind(0.11);
  Parallel parallel(2);
  const auto image_of = [&](const SceneFile& scene) {
    Camera camera(scene, {}, parallel);
    MountedLens lens(scene);
    EXPECT_GT(camera.certify(lens, nominal_pose(), {1, 0, 512}, 3), 1000);
    images::Image image(static_cast<std::size_t>(scene.sensor.width), static_cast<std::size_t>(scene.sensor.height));
    camera.render_noise_free(lens, nominal_pose(), 1, 64, image.values.data());
    return image;
  };
  const images::Image image = image_of(close), usual = image_of(relign_od_scene());
  double sum = 0, usual_sum = 0;
  for (const float value : image.values) sum += static_cast<double>(value);
  for (const float value : usual.values) usual_sum += static_cast<double>(value);
  EXPECT_NEAR(sum / usual_sum, 1, 1e-3);
}

TEST(Bounds, WavelengthsShareTheRegions) {
  SceneFile scene = relign_od_scene();
  scene.wavelengths.resize(24);
  EXPECT_EQ(search_pupil(scene, scene.lens).range().most_places, kMostPlaces / 25);
}

class BoundsOfFiles : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  // A copy of the phone lens and its scene, after `change` of the lens.
  template <class Change>
  fs::path phone_after(const Change& change) const {
    const fs::path phone = fs::path(RELIGN_SOURCE_DIR) / "tests/simulator/imaging/phone";
    Json lens = Json::parse(read_file(phone / "lens.json"));
    change(lens);
    write_file_atomically(folder_ / "lens.json", lens.dump());
    write_file_atomically(folder_ / "scene.json", read_file(phone / "scene.json"));
    return folder_ / "scene.json";
  }
  std::string refusal(const fs::path& scene) const {
    return test::error_text(ErrorKind::bad_input, [&] { read_scene_file(scene, {}); });
  }

  const fs::path folder_ = testing::TempDir() + "relign-bounds";
};

TEST_F(BoundsOfFiles, RefusesFacesTooBentToTrace) {
  const fs::path scene = phone_after([](Json& lens) { lens["elements"][2]["faces"][1]["even_asphere"][3] = 0.0042; });
  EXPECT_EQ(refusal(scene),
            (folder_ / "lens.json").string() +
                ": images would take too long: tracing a ray is as much work as crossing 498 spherical "
                "faces, at most 250 are allowed; most of it finds the hits on polynomial faces, of which "
                "face 2 of 'L3' is bent most: reduce its high-order coefficients or its semi-diameter");
}

TEST_F(BoundsOfFiles, RefusesTooManyFaces) {
  const fs::path scene = phone_after([](Json& lens) {
    Json plates = Json::array();
    for (int i = 0; i < 120; ++i)
      plates.push_back(
          {{"name", "P" + std::to_string(i)},
           {"faces",
            {{{"z_mm", -1 + 0.002 * i}, {"radius_mm", nullptr}, {"index_after", 1.5}, {"clear_radius_mm", 3}},
             {{"z_mm", -0.999 + 0.002 * i}, {"radius_mm", nullptr}, {"clear_radius_mm", 3}}}}});
    for (const Json& element : lens["elements"]) plates.push_back(element);
    lens["elements"] = plates;
  });
  EXPECT_EQ(refusal(scene),
            (folder_ / "lens.json").string() +
                ": images would take too long: tracing a ray is as much work as crossing 312 spherical "
                "faces, at most 250 are allowed; remove faces, or the polynomials of faces that need none");
}

// Numbers of the file scaled by up to a million: each gives a scene within the bounds or a refusal.
TEST_F(BoundsOfFiles, HoldForScaledNumbers) {
  std::mt19937_64 random(1);
  const auto one_of = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
  constexpr double kFactors[] = {-1, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1.1, 2, 10, 1e3, 1e6};
  int made = 0, refused = 0;
  for (int i = 0; i < 60; ++i) {
    const fs::path file = phone_after([&](Json& lens) {
      Json& faces = lens["elements"][one_of(3)]["faces"][one_of(2)];
      const double factor = kFactors[one_of(std::size(kFactors))];
      switch (one_of(4)) {
        case 0: {
          Json& terms = faces["even_asphere"];
          Json& term = terms[one_of(terms.size())];
          term = factor * term.get<double>();
          break;
        }
        case 1:
          faces["radius_mm"] = factor * faces["radius_mm"].get<double>();
          break;
        case 2:
          faces["clear_radius_mm"] = factor * faces["clear_radius_mm"].get<double>();
          break;
        default:
          lens["image_z_mm"] = factor * lens["image_z_mm"].get<double>();
      }
    });
    try {
      const SceneFile scene = read_scene_file(file, {});
      ++made;
      EXPECT_LE(scene.pupil->grid().places(), kMostPlaces) << i;
      EXPECT_LE(scene.pupil->work().all(), optics::PupilSearch::kMostWork) << i;
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::bad_input)) << i << ": " << error.what();
      EXPECT_THAT(error.what(), HasSubstr("lens.json")) << i;
    }
  }
  EXPECT_GT(made, 10);
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace relign::imaging
