// The scene through the plugin interface, as the harness uses it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "base/json_source.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {
namespace {

using testing::HasSubstr;

class LensSystemTest : public testing::Test {
 protected:
  LensSystemTest() {
    catalog_.add(std::string(RELIGN_PLUGIN_DIR) + "/lens_system");
    services_.cache_folder = cache_folder();
  }
  std::string failure(const std::string& id, const Json& given) {
    try {
      Scene scene(catalog_.resolve_or_throw(Kind::scene, id, given), services_);
    } catch (const Error& error) {
      return error.what();
    }
    return "no failure";
  }
  Catalog catalog_;
  HostServices services_;
};

TEST_F(LensSystemTest, DescribesPaperScene) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od"), services_);
  const Json facts = Json::parse(scene.describe());
  EXPECT_EQ(facts.at("axes").size(), 5u);
  EXPECT_EQ(facts.at("elements"), (Json{"L1", "L2", "L3", "L4"}));
  EXPECT_EQ(facts.at("image").at("width"), 200);
  EXPECT_NEAR(facts.at("image").at("white").get<double>(), 0.112, 0.003);
  EXPECT_EQ(facts.at("files").size(), 2u);
  EXPECT_EQ(facts.at("geometry").at("pivot_z_mm"), 0.0);
  EXPECT_EQ(facts.at("geometry").at("elements").at("L3"), (Json{{"front_z_mm", 12.877042}, {"back_z_mm", 14.772536}}));
  const relign_image image = scene.reference();
  ASSERT_EQ(image.width, 200u);
  double mean = 0;
  for (int i = 0; i < 40000; ++i) mean += image.pixels[i];
  EXPECT_NEAR(mean / 40000, 0.0181, 0.0003);
}

TEST_F(LensSystemTest, EveryPresetCaptures) {
  const std::vector<std::string> ids = catalog_.ids(Kind::scene);
  int scenes = 0;
  for (const std::string& id : ids) {
    if (id == "lens_system") continue;
    ++scenes;
    Scene scene(catalog_.resolve_or_throw(Kind::scene, id, {{"pixels", 20}}), services_);
    const Json facts = Json::parse(scene.describe());
    EXPECT_EQ(facts.at("axes").size(), 5u) << id;
    EXPECT_TRUE(facts.contains("machine_time") && facts.contains("spec")) << id;
    MountedAssembly assembly = scene.mount("{}");
    const Json& image = facts.at("image");
    std::vector<float> pixels(image.at("width").get<std::size_t>() * image.at("height").get<std::size_t>(), -1);
    assembly.capture({0.5, 0.5, 0.5, 0.5, 0.5}, 1, pixels.data());
    EXPECT_GE(*std::min_element(pixels.begin(), pixels.end()), 0.0F) << id;
    EXPECT_GT(*std::max_element(pixels.begin(), pixels.end()), 0.0F) << id;
  }
  EXPECT_EQ(scenes, 14);
}

TEST_F(LensSystemTest, HasSixthAxisOnRequest) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od", {{"rotation_z", true}, {"pixels", 50}}), services_);
  const Json facts = Json::parse(scene.describe());
  EXPECT_EQ(facts.at("axes").at(5).at("name"), "Rz");
  EXPECT_EQ(facts.at("image").at("height"), 50);
  MountedAssembly assembly = scene.mount("{}");
  std::vector<float> pixels(2500, -1);
  assembly.capture({0.5, 0.5, 0.5, 0.5, 0.5, 0.5}, 1, pixels.data());
  EXPECT_GE(*std::min_element(pixels.begin(), pixels.end()), 0.0F);
}

TEST_F(LensSystemTest, NoiseFreeMseIsUnbiasedAtTheOptimum) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od"), services_);
  MountedAssembly perfect = scene.mount("{}");
  const int n = 40;
  double sum = 0, squares = 0, errors = 0;
  for (int i = 0; i < n; ++i) {
    const auto truth = perfect.noise_free_mse({0.5, 0.5, 0.5, 0.5, 0.5}, static_cast<std::uint64_t>(i));
    sum += truth.mse;
    squares += truth.mse * truth.mse;
    errors += truth.standard_error;
    EXPECT_LT(truth.standard_error, 2e-7);
  }
  const double spread = std::sqrt(squares / n - sum * sum / n / n);
  EXPECT_NEAR(sum / n, 0, 4 * spread / std::sqrt(n) + 1e-8) << "the MSE at the optimum is 0";
  EXPECT_NEAR(errors / n / spread, 1, 0.35) << "the standard error must match the spread";
}

TEST_F(LensSystemTest, NoiseFreeMseMatchesNoiseFreeImages) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od"), services_);
  MountedAssembly tilted = scene.mount(R"({"L3": {"tilt_deg": [0.4, -0.3]}, "L4": {"shift_mm": [0, 0.01, 0]}})");
  const std::vector<double> pose = {0.55, 0.48, 0.6, 0.5, 0.45};
  std::vector<float> image(40000);
  ASSERT_TRUE(tilted.render_noise_free(pose, image.data()));
  const relign_image reference = scene.reference();
  double mse = 0;
  for (std::size_t i = 0; i < image.size(); ++i)
    mse += std::pow(static_cast<double>(image[i]) - static_cast<double>(reference.pixels[i]), 2) / 40000;
  const auto truth = tilted.noise_free_mse(pose, 9);
  EXPECT_NEAR(truth.mse, mse, 4 * truth.standard_error + 3e-7) << "the noise-free image has little noise";
}

TEST_F(LensSystemTest, MtfDoesNotDependOnPixels) {
  const std::vector<double> nominal(5, 0.5);
  std::vector<MountedAssembly::FieldMtf> found;
  for (const int pixels : {20, 40}) {
    Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od", {{"pixels", pixels}}), services_);
    const auto mtf = scene.mount("{}").mtf(nominal, 10);
    ASSERT_TRUE(mtf);
    found.push_back(*mtf);
  }
  EXPECT_NEAR(found[0].centre, 0.81, 0.01) << "geometric, see imaging_field_mtf";
  EXPECT_NEAR(found[0].corner, 0.91, 0.01);
  EXPECT_NEAR(found[0].centre, found[1].centre, 1e-9);
  EXPECT_NEAR(found[0].corner, found[1].corner, 1e-9);
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od", {{"pixels", 20}}), services_);
  const auto tilted = scene.mount(R"({"L3": {"tilt_deg": [1, 0]}})").mtf(nominal, 10);
  ASSERT_TRUE(tilted);
  EXPECT_LT(tilted->corner, found[0].corner - 0.002);
}

TEST_F(LensSystemTest, PackageSceneHasStrayLight) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od-package", {{"pixels", 40}}), services_);
  const relign_image image = scene.reference();
  double mean = 0, corner = 0;
  for (int i = 0; i < 1600; ++i) mean += image.pixels[i] / 1600;
  for (int i = 0; i < 6; ++i) corner += image.pixels[i] / 6;
  EXPECT_NEAR(mean, 0.0197, 0.0004) << "the package's own reference image: 0.0197";
  EXPECT_GT(corner, 0.00003) << "stray light reaches the corners";
  MountedAssembly perfect = scene.mount("{}");
  EXPECT_NEAR(perfect.noise_free_mse({0.5, 0.5, 0.5, 0.5, 0.5}, 1).mse, 0, 3e-5);
}

// What methods observe changes, what is scored does not.
TEST_F(LensSystemTest, ImagingErrorsAlterCapturesOnly) {
  struct Seen {
    std::vector<float> capture, reference, noise_free;
    double mse;
    bool operator==(const Seen& other) const = default;
  };
  const std::vector<double> pose = {0.52, 0.5, 0.5, 0.5, 0.5};
  const auto seen = [&](const Json& given, unsigned threads) {
    services_.threads = threads;
    Json parameters = {{"pixels", 50}};
    parameters.update(given);
    Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od", parameters), services_);
    const relign_image image = scene.reference();
    Seen found{std::vector<float>(2500), {image.pixels, image.pixels + 2500}, std::vector<float>(2500), 0};
    MountedAssembly assembly = scene.mount("{}");
    assembly.capture(pose, 4, found.capture.data());
    assembly.render_noise_free(pose, found.noise_free.data());
    found.mse = assembly.noise_free_mse(pose, 1).mse;
    return found;
  };
  const std::string file = std::string(RELIGN_PLUGIN_DIR) + "/lens_system/relign_od/sensor.json";
  const Seen ideal = seen(Json::object(), 1), altered = seen({{"imaging_errors", file}}, 1);
  EXPECT_NE(altered.capture, ideal.capture);
  EXPECT_EQ(altered.reference, ideal.reference);
  EXPECT_EQ(altered.noise_free, ideal.noise_free);
  EXPECT_EQ(altered.mse, ideal.mse);
  EXPECT_EQ(altered, seen({{"imaging_errors", file}}, 2)) << "with two threads";
  const auto folder = std::filesystem::temp_directory_path() / "relign-imaging-errors-test";
  write_file_atomically(folder / "none.json", "{}");
  EXPECT_EQ(seen({{"imaging_errors", (folder / "none.json").string()}}, 1), ideal) << "with an empty file";
  std::filesystem::remove_all(folder);

  // A parameter that is not given is not part of the identity, on which ids of trials depend.
  EXPECT_EQ(catalog_.resolve_or_throw(Kind::scene, "relign_od", {}).identity.find("imaging_errors"), std::string::npos);
  EXPECT_THAT(catalog_.resolve_or_throw(Kind::scene, "relign_od-sensor", {}).identity,
              HasSubstr("\"imaging_errors\":\"sha256:"));
}

TEST_F(LensSystemTest, ErrorsNameTheBadInput) {
  EXPECT_THAT(failure("relign_od", {{"target", "/no/such/file.png"}}), HasSubstr("/no/such/file.png"));
  EXPECT_THAT(failure("relign_od", {{"samples", 0}}), HasSubstr("samples"));
  EXPECT_THAT(failure("relign_od", {{"transport", "frensel"}}), HasSubstr("fresnel"));
  const auto folder = std::filesystem::temp_directory_path() / "relign-lens-system-test";
  write_file_atomically(folder / "text.png", "this is no image");
  EXPECT_THAT(failure("relign_od", {{"target", (folder / "text.png").string()}}),
              HasSubstr("not an image that can be read"));
  write_file_atomically(folder / "scene.json", R"({"use": "lens_system", "name": "x", "lens": "missing.json",
    "pivot_behind_first_vertex_mm": 1, "sensor": {"z_mm": 5, "side_mm": 1}, "emitter": {"z_mm": -5, "side_mm": 1},
    "travel": {}})");
  EXPECT_THAT(failure((folder / "scene.json").string(), {}), HasSubstr("missing.json"));
  write_file_atomically(folder / "scene.json", R"({"use": "lens_system", "sensor": {"z_mm": -5}})");
  const std::string text = failure((folder / "scene.json").string(), {});
  EXPECT_THAT(text, HasSubstr("missing key 'name'"));
  EXPECT_THAT(text, HasSubstr("scene.json:1:43: /sensor/z_mm: expected a number from 0.001"));
  std::filesystem::remove_all(folder);
}

// Against central differences of images with the same rays, at offsets that are not 0.
TEST_F(LensSystemTest, SlopesByOffsetsEqualDifferences) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od", {{"pixels", 100}}), services_);
  const std::vector<double> pose{0.52, 0.49, 0.505, 0.48, 0.51};
  constexpr std::size_t kPixels = 10'000, kAxes = 5;
  constexpr std::uint64_t kSeed = 5, kSamples = 1024;
  const auto offsets = [](std::size_t number, double by) {
    Json shift = {0.02, -0.01, 0.03}, tilt = {0.3, -0.2};
    Json& value = number < 3 ? shift[number] : tilt[number - 3];
    value = value.get<double>() + by;
    return Json{{"L1", {{"shift_mm", {0.01, 0, 0}}}}, {"L3", {{"shift_mm", shift}, {"tilt_deg", tilt}}}}.dump();
  };
  std::vector<float> slopes(kPixels * (1 + kAxes + 10));
  ASSERT_TRUE(scene.mount(offsets(0, 0)).render_slopes(pose, kSeed, kSamples, {0, 2}, slopes.data()));
  std::vector<float> ahead(kPixels), behind(kPixels);
  for (std::size_t number = 0; number < 5; ++number) {
    const double by = number < 3 ? 0.004 : 0.02;
    scene.mount(offsets(number, by)).render_average(pose, kSeed, 0, kSamples, ahead.data());
    scene.mount(offsets(number, -by)).render_average(pose, kSeed, 0, kSamples, behind.data());
    double product = 0, ours = 0, theirs = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      const double slope = slopes[(1 + kAxes + 5 + number) * kPixels + i];
      const double difference = static_cast<double>(ahead[i] - behind[i]) / (2 * by);
      product += slope * difference;
      ours += slope * slope;
      theirs += difference * difference;
    }
    // Noise lowers the correlation of a shift along the axis, which changes the image least.
    EXPECT_GT(product / std::sqrt(ours * theirs), number == 2 ? 0.85 : 0.98) << "offset " << number;
    EXPECT_NEAR(product / ours, 1, 0.05) << "offset " << number;
  }
}

TEST_F(LensSystemTest, RejectsUnknownElements) {
  Scene scene(catalog_.resolve_or_throw(Kind::scene, "relign_od"), services_);
  try {
    scene.mount(R"({"L9": {"tilt_deg": [0, 0]}})");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("L9"));
  }
}

}  // namespace
}  // namespace relign::plugin_host
