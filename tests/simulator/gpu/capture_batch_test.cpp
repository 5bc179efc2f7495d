// The kernels' functions in a plain loop on the CPU: images and MSE have the camera's bits.
#include "gpu/capture_batch.h"

#include <gmock/gmock.h>

#include <cmath>

#include "base/error.h"
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

// How many standard errors the sums' means differ by.
double sigmas(const Statistics& a, const Statistics& b) {
  const auto mean_and_error2 = [](const std::vector<double>& values) {
    double mean = 0, squares = 0;
    for (const double value : values) mean += value / static_cast<double>(values.size());
    for (const double value : values) squares += (value - mean) * (value - mean);
    const auto count = static_cast<double>(values.size());
    return std::pair{mean, squares / (count - 1) / count};
  };
  const auto [here, error_here] = mean_and_error2(a.sums);
  const auto [there, error_there] = mean_and_error2(b.sums);
  return std::fabs(here - there) / std::sqrt(error_here + error_there);
}

TEST(CaptureBatch, CapturesReflectionsWithTheDistributionOfTheCamera) {
  imaging::SceneChoices choices;
  choices.pixels = 40;
  const SceneFile scene = imaging::relign_od_scene_with(choices);
  Parallel two(2);
  const CaptureSettings settings = reflections(0.5);
  CaptureBatch batch(scene, settings, two);
  Camera camera(scene, settings, two), straight(scene, {}, two);
  Instances instances(scene, 1);
  Statistics here(scene.sensor.pixels()), there(scene.sensor.pixels()), without(scene.sensor.pixels());
  constexpr std::uint64_t kCaptures = 64;
  std::vector<float> pixels(scene.sensor.pixels());
  BatchItem item = instances.items.front();
  for (std::uint64_t seed = 1; seed <= kCaptures; ++seed) {
    item.seed = seed;
    batch.prepare({item}, CaptureBatch::Kind::capture);
    here.add(batch.capture_here().data());
    camera.capture(*item.lens, *item.true_pose, 1000 + seed, pixels.data());
    there.add(pixels.data());
    straight.capture(*item.lens, *item.true_pose, 2000 + seed, pixels.data());
    without.add(pixels.data());
  }
  EXPECT_LT(sigmas(here, there), 3.5);
  EXPECT_GT(sigmas(here, without), 10);
  // Squared differences of pixels in units of their variance, and the ratio of variances.
  double squares = 0, ratio = 0;
  int lit = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!(there.mean[i] > 0.01)) continue;
    ++lit;
    const double difference = here.mean[i] - there.mean[i];
    squares += difference * difference / (here.error2(i) + there.error2(i));
    ratio += std::log(here.variance[i] / there.variance[i]);
  }
  ASSERT_GT(lit, 300);
  EXPECT_NEAR(squares / lit, 1, 6 * std::sqrt(2.0 / lit));
  EXPECT_NEAR(ratio / lit, 0, 6 * std::sqrt(4.0 / kCaptures / lit));
}

}  // namespace
}  // namespace relign::gpu::capture_batch
