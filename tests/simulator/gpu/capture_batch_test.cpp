// The kernels' functions in a plain loop on the CPU: images and MSE have the camera's bits, images with reflections its
// distribution.
#include "gpu/capture_batch.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "imaging/capture_errors.h"
#include "imaging/reference.h"
#include "imaging/scene_under_test.h"

namespace relign::gpu::capture_batch {
namespace {

using imaging::BatchItem;
using imaging::Camera;
using imaging::CaptureSettings;
using imaging::MountedLens;
using imaging::SceneFile;
using imaging::Transport;
using testing::HasSubstr;

// Displaced lenses, two poses each: inside the travel and anywhere in it.
struct Instances {
  explicit Instances(const SceneFile& scene, int lens_count) {
    Random random(9);
    for (int i = 0; i < lens_count; ++i) {
      lenses.push_back(imaging::random_lens(scene, random));
      for (const double spread : {0.1, 0.5}) {
        std::vector<double> pose(scene.axes());
        for (double& value : pose) value = random.uniform(0.5 - spread, 0.5 + spread);
        poses.push_back(pose);
      }
    }
    for (std::size_t i = 0; i < poses.size(); ++i)
      items.push_back({lenses[i / 2].get(), &poses[i], 1'000'000'000'007ULL * (i + 1), nullptr});
  }
  std::vector<std::unique_ptr<MountedLens>> lenses;
  std::vector<std::vector<double>> poses;
  std::vector<BatchItem> items;
};

CaptureSettings reflections(double albedo) { return {Transport::ghost, imaging::Sampler::paper, 64, albedo}; }

void expect_bits_of_camera(const SceneFile& scene, const CaptureSettings& settings, int lens_count) {
  Instances instances(scene, lens_count);
  Parallel two(2);
  CaptureBatch batch(scene, settings, two);
  batch.prepare(instances.items, CaptureBatch::Kind::capture);
  const std::vector<float> images = batch.capture_here();
  Camera camera(scene, settings, two);
  std::vector<float> expected(scene.sensor.pixels());
  int lit = 0;
  for (std::size_t i = 0; i < instances.items.size(); ++i) {
    camera.capture(*instances.items[i].lens, instances.poses[i], instances.items[i].seed, expected.data());
    const auto first = images.begin() + static_cast<std::ptrdiff_t>(i * expected.size());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), first)) << scene.name << " " << i;
    lit += *std::max_element(expected.begin(), expected.end()) > 0 ? 1 : 0;
  }
  EXPECT_GT(lit, 0) << scene.name;
}

TEST(CaptureBatch, CapturesWithTheBitsOfTheCamera) {
  expect_bits_of_camera(imaging::relign_od_scene(), {}, 4);
  CaptureSettings refract;
  refract.transport = Transport::refract;
  refract.samples = 9;
  expect_bits_of_camera(imaging::relign_od_scene(), refract, 1);
}

TEST(CaptureBatch, CapturesEveryShippedSceneOfSpheresWithTheBitsOfTheCamera) {
  int compared = 0;
  for (const std::string& name : imaging::shipped_scenes()) {
    imaging::SceneChoices choices;
    choices.pixels = 48;
    const SceneFile scene = imaging::read_scene_file(imaging::scene_folder() + name + "/scene.json", choices);
    if (!unsupported(scene, {}).empty()) continue;
    expect_bits_of_camera(scene, {}, 1);
    ++compared;
  }
  EXPECT_GT(compared, 2);
}

// Conics: the strongest surface of the paper's lens made a little elliptic.
TEST(CaptureBatch, CapturesConicsWithTheBitsOfTheCamera) {
  SceneFile scene = imaging::relign_od_scene();
  scene.lens.elements[0].faces[1].conic = -0.02;
  scene.lens.elements[2].faces[0].conic = 0.1;
  scene.pupil = nullptr;
  expect_bits_of_camera(scene, {}, 1);
}

TEST(CaptureBatch, EstimatesMseWithTheBitsOfTheCamera) {
  const SceneFile& scene = imaging::relign_od_scene();
  Instances instances(scene, 2);
  Parallel two(2);
  imaging::Reference reference;
  Camera camera(scene, {}, two);
  MountedLens perfect(scene);
  for (std::vector<float>* image : {&reference.first, &reference.second}) {
    image->resize(scene.sensor.pixels());
    camera.render_noise_free(perfect, imaging::nominal_pose(), image == &reference.first ? 1 : 2, 64, image->data());
  }
  for (const Transport transport : {Transport::fresnel, Transport::refract}) {
    CaptureSettings settings;
    settings.transport = transport;
    CaptureBatch batch(scene, settings, two);
    batch.prepare(instances.items, CaptureBatch::Kind::noise_free_mse);
    const std::vector<imaging::MseEstimate> all = batch.mse_here(reference);
    ASSERT_EQ(all.size(), instances.items.size());
    Camera own(scene, settings, two);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const imaging::MseEstimate expected =
          own.noise_free_mse(*instances.items[i].lens, instances.poses[i], instances.items[i].seed, reference);
      EXPECT_EQ(all[i].mse, expected.mse) << i;
      EXPECT_EQ(all[i].standard_error, expected.standard_error) << i;
      EXPECT_GT(all[i].standard_error, 0);
    }
  }
}

TEST(CaptureBatch, RefusesWhatTheKernelsLack) {
  Parallel alone(1);
  const SceneFile& paper = imaging::relign_od_scene();
  const auto refused = [&](const SceneFile& scene, const CaptureSettings& settings) -> std::string {
    try {
      CaptureBatch(scene, settings, alone);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refused(paper, {}), "");
  CaptureSettings settings;
  settings.sampler = imaging::Sampler::lattice;
  EXPECT_THAT(refused(paper, settings), HasSubstr("samplers other than 'paper'"));
  settings = {};
  settings.scored_tiles = 4;
  EXPECT_THAT(refused(paper, settings), HasSubstr("'scored_tiles' other than 1"));
  SceneFile bent = paper;
  bent.lens.elements[1].faces[1].even_asphere = {1e-5};
  EXPECT_THAT(refused(bent, {}), HasSubstr("polynomial faces, such as face 2 of L2"));
  SceneFile windowed = paper;
  windowed.sensor.windows = {{0, 0, 12, 12}};
  EXPECT_THAT(refused(windowed, {}), HasSubstr("a sensor with windows"));
  SceneFile conic = paper;
  conic.lens.elements[0].faces[1].conic = -0.02;
  EXPECT_THAT(refused(conic, reflections(0)), HasSubstr("transport 'ghost' supports only spheres and planes"));
  Instances instances(paper, 1);
  CaptureBatch batch(paper, reflections(0), alone);
  EXPECT_THROW(batch.prepare(instances.items, CaptureBatch::Kind::noise_free_mse), Error);
}

// Means and variances of each pixel and of the sum of all, from captures with different seeds.
struct Statistics {
  explicit Statistics(std::size_t pixels) : mean(pixels), variance(pixels) {}
  void add(const float* pixels) {
    ++captures;
    double sum = 0;
    for (std::size_t i = 0; i < mean.size(); ++i) {
      const double value = static_cast<double>(pixels[i]), step = value - mean[i];
      sum += value;
      mean[i] += step / captures;
      variance[i] += step * (value - mean[i]);
    }
    sums.push_back(sum);
  }
  // Of a mean.
  double error2(std::size_t pixel) const { return variance[pixel] / (captures - 1) / captures; }
  std::vector<double> mean, variance, sums;
  int captures = 0;
};

// And the squared error of the mean.
std::pair<double, double> mean_and_error2(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  const auto count = static_cast<double>(values.size());
  return {mean, squares / (count - 1) / count};
}

// How many standard errors the sums' means differ by, of independent captures.
double sigmas(const Statistics& a, const Statistics& b) {
  const auto [here, error_here] = mean_and_error2(a.sums);
  const auto [there, error_there] = mean_and_error2(b.sums);
  return std::fabs(here - there) / std::sqrt(error_here + error_there);
}

// A lens of the package's scene, which reflects and whose sensor scatters, with these sensor pixels.
SceneFile package_scene(int width, int height) {
  imaging::SceneChoices choices;
  choices.pixels = 40;
  SceneFile scene = imaging::read_scene_file(imaging::scene_folder() + "relign_od/package.json", choices);
  const double side = scene.sensor.pitch_mm * scene.sensor.width;
  scene.sensor.width = width;
  scene.sensor.height = height;
  scene.sensor.pitch_mm = side / std::max(width, height);
  scene.sensor.left_mm = -0.5 * width * scene.sensor.pitch_mm;
  scene.sensor.top_mm = 0.5 * height * scene.sensor.pitch_mm;
  scene.pupil = nullptr;
  return scene;
}

struct Law {
  Statistics here, there, difference;
  std::vector<std::int32_t> whole_discs;  // of the boxes
};

// Captures of the kernels' functions and of the camera with equal seeds, whose paths begin alike.
Law compare(const SceneFile& scene, double albedo, const std::vector<double>& pose, int captures,
            const imaging::ImagingErrors* errors = nullptr) {
  constexpr double kWhite = 0.3;
  Parallel two(2);
  const CaptureSettings settings = reflections(albedo);
  Random random(5);
  const auto lens = imaging::random_lens(scene, random);
  std::optional<imaging::CaptureErrors> drawn;
  if (errors) drawn.emplace(*errors, scene.sensor, kWhite, scene.emitter.side_mm);
  CaptureBatch batch(scene, settings, two, drawn ? &drawn->drawn() : nullptr);
  Camera camera(scene, settings, two);
  const std::size_t count = scene.sensor.pixels();
  Law law{Statistics(count), Statistics(count), Statistics(count), {}};
  std::vector<float> pixels(count), differences(count);
  for (int capture = 1; capture <= captures; ++capture) {
    const auto seed = static_cast<std::uint64_t>(capture);
    batch.prepare({{lens.get(), &pose, seed, nullptr}}, CaptureBatch::Kind::capture);
    const std::vector<float> found = batch.capture_here();
    const bool altered = drawn && drawn->draw(seed);
    camera.capture(*lens, pose, seed, pixels.data(), altered ? drawn->into_print() : std::nullopt);
    if (altered) drawn->apply(pixels.data());
    for (std::size_t i = 0; i < count; ++i) differences[i] = found[i] - pixels[i];
    law.here.add(found.data());
    law.there.add(pixels.data());
    law.difference.add(differences.data());
  }
  for (const GhostBoxJob& box : batch.ghosts().boxes) law.whole_discs.push_back(box.whole_disc);
  return law;
}

void expect_equal(const Law& law) {
  const auto [difference, error2] = mean_and_error2(law.difference.sums);
  EXPECT_LT(std::fabs(difference) / std::sqrt(error2), 3.5);
  // All pixels that differ, those without direct light, too (another choice would be a bias): squared means of the
  // differences in units of their error, and the variance.
  double chi2 = 0, here = 0, there = 0;
  int differing = 0;
  for (std::size_t i = 0; i < law.here.mean.size(); ++i) {
    here += law.here.variance[i];
    there += law.there.variance[i];
    if (!(law.difference.variance[i] > 0)) continue;
    ++differing;
    chi2 += law.difference.mean[i] * law.difference.mean[i] / law.difference.error2(i);
  }
  ASSERT_GT(differing, 500);
  EXPECT_NEAR(chi2 / differing, 1, 0.2);
  EXPECT_NEAR(here / there, 1, 0.05);
}

const std::vector<double>& oblique_pose() {
  static const std::vector<double> pose = {0.62, 0.4, 0.55, 0.6, 0.35};
  return pose;
}

TEST(CaptureBatch, CapturesReflectionsWithTheDistributionOfTheCamera) {
  const SceneFile scene = package_scene(37, 53);
  const Law law = compare(scene, 0.5, oblique_pose(), 60);
  expect_equal(law);
  Parallel two(2);
  Random random(5);
  const auto lens = imaging::random_lens(scene, random);
  Camera straight(scene, {}, two);
  Statistics without(scene.sensor.pixels());
  std::vector<float> pixels(scene.sensor.pixels());
  for (std::uint64_t seed = 1001; seed <= 1060; ++seed) {
    straight.capture(*lens, oblique_pose(), seed, pixels.data());
    without.add(pixels.data());
  }
  EXPECT_GT(sigmas(law.here, without), 10);
}

// Of its light alone: what albedo 1 adds to captures that begin alike.
TEST(CaptureBatch, SensorScattersAsMuchAsTheCameras) {
  const SceneFile scene = package_scene(40, 40);
  const Law dark = compare(scene, 0, oblique_pose(), 100), bright = compare(scene, 1, oblique_pose(), 100);
  expect_equal(bright);
  Statistics here(1), there(1);
  for (std::size_t i = 0; i < dark.here.sums.size(); ++i) {
    const auto of_here = static_cast<float>(bright.here.sums[i] - dark.here.sums[i]);
    const auto of_there = static_cast<float>(bright.there.sums[i] - dark.there.sums[i]);
    here.add(&of_here);
    there.add(&of_there);
  }
  EXPECT_GT(there.mean[0], 0);
  EXPECT_LT(sigmas(here, there), 3.5);
  EXPECT_LT(std::sqrt(here.error2(0) + there.error2(0)), 0.06 * there.mean[0]);  // it would notice a quarter less
}

TEST(CaptureBatch, CapturesReflectionsOfWholeDiscsBarrelsAndImagingErrors) {
  SceneFile close = package_scene(40, 40);
  const double last = close.lens.elements.back().faces.back().z_mm;
  close.sensor.z_mm = 8.62;  // among the rims of the last element
  close.pupil = nullptr;
  const Law whole = compare(close, 1, {0.5, 0.5, 0.5, 0.5, 0.5}, 20);
  EXPECT_THAT(whole.whole_discs, testing::Contains(1));
  expect_equal(whole);
  SceneFile narrow = package_scene(40, 40);
  narrow.lens.barrel = optics::Barrel{0.9 * narrow.lens.elements.back().faces.back().clear_radius_mm, -0.5, last + 1};
  narrow.pupil = nullptr;
  expect_equal(compare(narrow, 1, oblique_pose(), 40));
  const imaging::ImagingErrors errors =
      imaging::read_imaging_errors(std::string(RELIGN_SOURCE_DIR) + "/python/relign_bench/training/randomisation.json");
  expect_equal(compare(package_scene(40, 40), 0.5, oblique_pose(), 40, &errors));
}

}  // namespace
}  // namespace relign::gpu::capture_batch
