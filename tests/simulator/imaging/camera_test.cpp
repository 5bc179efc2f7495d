// Images are pure functions of pose and seed; captures do not allocate; radiometry and orientation are correct.
#include "imaging/camera.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "base/error.h"
#include "base/hash.h"
#include "optics/first_order.h"
#include "optics/trace.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

constexpr std::size_t kFramePixels = 200 * 200;

std::vector<float> image_with(unsigned threads, Sampler sampler, const std::vector<double>& pose, std::uint64_t seed) {
  Parallel parallel(threads);
  Random random(3);
  Camera camera(relign_od_scene(), {Transport::fresnel, sampler, 64}, parallel);
  MountedLens lens(relign_od_scene(), random_assembly(random));
  std::vector<float> image(kFramePixels, -1.0F);
  camera.capture(lens, pose, seed, image.data());
  return image;
}

TEST(Camera, ImagesDoNotDependOnThreads) {
  const std::vector<double> pose = {0.3, 0.6, 0.55, 0.8, 0.4};
  for (const Sampler sampler : {Sampler::paper, Sampler::pupil}) {
    const std::vector<float> one = image_with(1, sampler, pose, 42);
    EXPECT_EQ(one, image_with(2, sampler, pose, 42));
    EXPECT_EQ(one, image_with(7, sampler, pose, 42));
    EXPECT_NE(one, image_with(1, sampler, pose, 43));
  }
}

TEST(Camera, ImagesDoNotDependOnEarlierRenders) {
  Parallel parallel(1);
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene());
  std::vector<float> fresh(kFramePixels), later(kFramePixels);
  camera.capture(lens, nominal_pose(), 5, fresh.data());
  camera.capture(lens, {0.9, 0.1, 0.2, 0.9, 0.1}, 6, later.data());
  camera.capture(lens, nominal_pose(), 5, later.data());
  EXPECT_EQ(fresh, later);
}

TEST(Camera, MseDoesNotDependOnThreads) {
  Parallel one(1), two(2);
  const Reference reference = make_reference(relign_od_scene(), {}, two, {}, {});
  Camera a(relign_od_scene(), {}, one);
  MountedLens a_lens(relign_od_scene());
  Camera b(relign_od_scene(), {}, two);
  MountedLens b_lens(relign_od_scene());
  const std::vector<double> pose = {0.52, 0.5, 0.45, 0.5, 0.51};
  EXPECT_EQ(a.noise_free_mse(a_lens, pose, 1, reference).mse, b.noise_free_mse(b_lens, pose, 1, reference).mse);
}

TEST(Camera, MseIsUnbiasedFarFromTheOptimum) {
  Parallel parallel(2);
  const Reference reference = make_reference(relign_od_scene(), {}, parallel, {}, {});
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene());
  const std::vector<double> pose = {0.6, 0.4, 0.7, 0.45, 0.6};
  std::vector<float> image(kFramePixels);
  camera.render_noise_free(lens, pose, 77, 1024, image.data());
  double direct = 0;
  for (std::size_t i = 0; i < kFramePixels; ++i)
    direct += std::pow(static_cast<double>(image[i]) - static_cast<double>(reference.mean[i]), 2) / kFramePixels;
  const int n = 50;
  double sum = 0, squares = 0, error = 0;
  for (std::uint64_t seed = 0; seed < n; ++seed) {
    const MseEstimate estimate = camera.noise_free_mse(lens, pose, seed, reference);
    sum += estimate.mse / n;
    squares += estimate.mse * estimate.mse / n;
    error += estimate.standard_error / n;
  }
  const double spread = std::sqrt(squares - sum * sum);
  EXPECT_NEAR(sum, direct, 5 * spread / std::sqrt(n) + 3e-7);
  EXPECT_NEAR(error / spread, 1, 0.35);
}

// With more pixels than kMsePixels there are fewer rays for each.
TEST(Camera, MseOfManyPixelsIsUnbiased) {
  Parallel parallel(2);
  SceneChoices choices;
  choices.pixels = 600;
  const SceneFile scene =
      read_scene_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/scene.json", choices);
  ASSERT_GT(static_cast<double>(scene.sensor.pixels()), 4 * kMsePixels);
  const Reference reference = make_reference(scene, {}, parallel, {}, {});
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  const std::vector<double> pose = {0.52, 0.5, 0.5, 0.5, 0.49};
  std::vector<float> image(scene.sensor.pixels());
  camera.render_noise_free(lens, pose, 77, 1024, image.data());
  double direct = 0;
  for (std::size_t i = 0; i < image.size(); ++i)
    direct += std::pow(static_cast<double>(image[i]) - static_cast<double>(reference.mean[i]), 2);
  direct /= static_cast<double>(image.size());
  const int n = 20;
  double sum = 0, squares = 0, error = 0;
  for (std::uint64_t seed = 0; seed < n; ++seed) {
    const MseEstimate estimate = camera.noise_free_mse(lens, pose, seed, reference);
    sum += estimate.mse / n;
    squares += estimate.mse * estimate.mse / n;
    error += estimate.standard_error / n;
  }
  const double spread = std::sqrt(squares - sum * sum);
  EXPECT_NEAR(sum, direct, 5 * spread / std::sqrt(n) + 3e-7);
  EXPECT_NEAR(error / spread, 1, 0.5);
}

TEST(Camera, MseOfSomeTilesIsNearThatOfAll) {
  Parallel one(1), two(2);
  SceneChoices choices;
  choices.pixels = 600;
  const SceneFile scene =
      read_scene_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/scene.json", choices);
  const Reference reference = make_reference(scene, {}, two, {}, {});
  CaptureSettings some;
  some.scored_tiles = 4;
  Camera all_tiles(scene, {}, two), camera(scene, some, two), other_threads(scene, some, one);
  MountedLens lens(scene), same(scene), again(scene);
  for (const std::vector<double>& pose : {std::vector<double>{0.6, 0.4, 0.7, 0.45, 0.6}, {0.5, 0.5, 0.45, 0.5, 0.5}}) {
    const MseEstimate expected = all_tiles.noise_free_mse(lens, pose, 3, reference);
    const MseEstimate found = camera.noise_free_mse(same, pose, 3, reference);
    EXPECT_NEAR(found.mse / expected.mse, 1, 0.3);  // other pixels: most of the error is in few tiles
    EXPECT_NE(found.mse, expected.mse);
    EXPECT_NEAR(found.standard_error / expected.standard_error, 2, 0.6);  // of a quarter of the rays
    EXPECT_EQ(other_threads.noise_free_mse(again, pose, 3, reference).mse, found.mse);
  }
}

TEST(Camera, RefusesSomeTilesWhereImagesAreWhole) {
  Parallel parallel(1);
  CaptureSettings settings;
  settings.scored_tiles = 4;
  settings.transport = Transport::ghost;
  EXPECT_THROW(Camera(relign_od_scene(), settings, parallel), Error);
}

// Run by the test below, once per instruction set: prints a hash of its images.
TEST(Camera, DISABLED_PrintHash) {
  std::string bytes;
  for (const Sampler sampler : {Sampler::paper, Sampler::pupil}) {
    const std::vector<float> image = image_with(1, sampler, {0.45, 0.6, 0.52, 0.7, 0.4}, 42);
    bytes.append(reinterpret_cast<const char*>(image.data()), image.size() * sizeof(float));
  }
  Parallel parallel(1);
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene());
  std::vector<float> image(kFramePixels);
  camera.render_noise_free(lens, nominal_pose(), 3, 8, image.data());
  bytes.append(reinterpret_cast<const char*>(image.data()), image.size() * sizeof(float));
  std::printf("hash %s\n", sha256_hex(bytes).c_str());
}

TEST(Camera, ImagesAreTheSameOnEveryInstructionSet) {
  std::map<std::string, std::string> hashes;
  for (const char* isa : {"generic", "avx2", "avx512"}) {
    if (!optics::block_kernels(isa)) continue;
    const std::string command = std::string("RELIGN_ISA=") + isa + " '" +
                                std::filesystem::read_symlink("/proc/self/exe").string() +
                                "' --gtest_also_run_disabled_tests --gtest_filter=Camera.DISABLED_PrintHash";
    FILE* pipe = ::popen(command.c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    char line[256];
    while (std::fgets(line, sizeof line, pipe))
      if (std::string(line).rfind("hash ", 0) == 0) hashes[isa] = line;
    ASSERT_EQ(::pclose(pipe), 0) << command;
    ASSERT_FALSE(hashes[isa].empty());
    EXPECT_EQ(hashes[isa], hashes["generic"]) << isa;
  }
  if (hashes.size() < 2) GTEST_SKIP() << "this processor has one instruction set only";
}

// The same irradiance on coarser pixels: means over blocks of the fine image.
TEST(Camera, CoarseSensorsAverageTheFineImage) {
  Parallel parallel(2);
  Camera fine(relign_od_scene(), {}, parallel);
  MountedLens fine_lens(relign_od_scene());
  std::vector<float> expected(kFramePixels);
  const std::vector<double> pose = {0.55, 0.45, 0.5, 0.52, 0.5};
  fine.render_noise_free(fine_lens, pose, 1, 64, expected.data());
  for (const int pixels : {100, 50, 20, 10, 3}) {
    SceneChoices choices;
    choices.pixels = pixels;
    const SceneFile scene = relign_od_scene_with(choices);
    Camera coarse(scene, {}, parallel);
    MountedLens coarse_lens(scene);
    std::vector<float> image(static_cast<std::size_t>(pixels * pixels));
    coarse.render_noise_free(coarse_lens, pose, 1, 2048, image.data());
    double ours = 0, theirs = 0;
    for (const float value : image) ours += static_cast<double>(value) / image.size();
    for (const float value : expected) theirs += static_cast<double>(value) / kFramePixels;
    EXPECT_NEAR(ours, theirs, 0.01 * theirs) << pixels;
    if (200 % pixels != 0) continue;
    const int block = 200 / pixels;
    double worst = 0;
    for (int row = 0; row < pixels; ++row)
      for (int column = 0; column < pixels; ++column) {
        double mean = 0;
        for (int y = 0; y < block; ++y)
          for (int x = 0; x < block; ++x)
            mean +=
                static_cast<double>(expected[static_cast<std::size_t>((row * block + y) * 200 + column * block + x)]);
        worst = std::max(worst, std::fabs(mean / block / block -
                                          static_cast<double>(image[static_cast<std::size_t>(row * pixels + column)])));
      }
    EXPECT_LT(worst, 0.01) << pixels;
  }
}

// Captures do not allocate: the heap in use stays the same (short form of 100,000 captures; set RELIGN_CAPTURES for the
// long one).
TEST(Camera, CapturesDoNotGrowTheHeap) {
  int captures = 1000;
  if (const char* wish = std::getenv("RELIGN_CAPTURES")) captures = std::atoi(wish);
  Parallel parallel(2);
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene());
  std::vector<float> image(kFramePixels);
  Random random(1);
  std::vector<double> pose(5);
  const auto capture = [&](int i) {
    for (double& value : pose) value = random.uniform();
    camera.capture(lens, pose, static_cast<std::uint64_t>(i), image.data());
  };
  for (int i = 0; i < 20; ++i) capture(i);
  const auto before = mallinfo2().uordblks;
  for (int i = 0; i < captures; ++i) capture(i);
  const auto after = mallinfo2().uordblks;
  EXPECT_LE(after, before + 4096) << "bytes in use after " << captures << " captures";
}

// Light from a spot on the emitter arrives where the double tracer predicts: bitmap row 0 at y = -half side, column 0
// at x = -half side; image row 0 at y = +half side.
TEST(Camera, OrientationMatchesTheTracer) {
  SceneFile scene = relign_od_scene();
  images::Image bitmap(600, 600);
  const std::size_t n = bitmap.width;
  // A spot at 3/4 of the width and 5/8 of the height of the bitmap.
  const double at_x = 0.75, at_y = 0.625;
  for (std::size_t y = 0; y < n; ++y)
    for (std::size_t x = 0; x < n; ++x)
      if (std::hypot((x + 0.5) / n - at_x, (y + 0.5) / n - at_y) < 0.01) bitmap.at(x, y) = 1;
  scene.emitter.show(bitmap);
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  const std::vector<double> pose = {0.56, 0.47, 0.5, 0.54, 0.48};
  std::vector<float> image(kFramePixels);
  camera.render_noise_free(lens, pose, 1, 256, image.data());
  double sum = 0, x_mm = 0, y_mm = 0;
  for (std::size_t row = 0; row < 200; ++row)
    for (std::size_t column = 0; column < 200; ++column) {
      const double value = static_cast<double>(image[row * 200 + column]);
      sum += value;
      const optics::Vec3 place = scene.sensor.place(column + 0.5, row + 0.5);
      x_mm += value * place.x;
      y_mm += value * place.y;
    }
  ASSERT_GT(sum, 0);
  // Forward: a bundle from the spot through the lens to the sensor plane.
  const optics::Motion lens_to_world = scene.lens_to_world(pose);
  const optics::Motion to_lens = optics::inverse(lens_to_world);
  const optics::Vec3 spot{(at_x - 0.5) * scene.emitter.side_mm, (at_y - 0.5) * scene.emitter.side_mm,
                          scene.emitter.z_mm};
  const optics::Vec3 from = to_lens.point(spot);
  double rays = 0, traced_x = 0, traced_y = 0;
  const optics::Assembly perfect(scene.lens);
  for (double u = -2; u <= 2; u += 0.05)
    for (double v = -2; v <= 2; v += 0.05) {
      const optics::Vec3 towards{u, v, optics::first_order(scene.lens).entrance_pupil_z};
      const optics::TracedRay ray = optics::trace(perfect, {from, towards - from}, optics::Apertures::mesh);
      if (!ray.passed) continue;
      const optics::Vec3 at = lens_to_world.point(ray.image), d = lens_to_world.direction(ray.exit_direction);
      const double t = (scene.sensor.z_mm - at.z) / d.z;
      traced_x += at.x + t * d.x;
      traced_y += at.y + t * d.y;
      rays += 1;
    }
  ASSERT_GT(rays, 100);
  EXPECT_NEAR(x_mm / sum, traced_x / rays, 0.1 * scene.sensor.pitch_mm);
  EXPECT_NEAR(y_mm / sum, traced_y / rays, 0.1 * scene.sensor.pitch_mm);
}

// A uniform emitter of radiance 1: irradiance on the axis = projected solid angle of the exit cone,
// times the transmittance of eight faces (here refract: none is lost).
TEST(Camera, MatchesSolidAngleOnTheAxis) {
  SceneFile scene = relign_od_scene();
  scene.emitter.show(images::Image(2, 2, 1.0F));
  Parallel parallel(2);
  Camera camera(scene, {Transport::refract, Sampler::paper, 64}, parallel);
  MountedLens lens(scene);
  std::vector<float> image(kFramePixels);
  camera.render_noise_free(lens, nominal_pose(), 1, 1024, image.data());
  // The cone of directions at the sensor's centre: light that ends there, found by turning the lens
  // around. The double tracer runs object to image, so aim by bisection: for each pupil height the object
  // height whose ray ends on the axis, then the largest pupil height that passes.
  const optics::Assembly perfect(scene.lens);
  const double pupil_z = optics::first_order(scene.lens).entrance_pupil_z;
  const double object_z = scene.emitter.z_mm + scene.pivot_behind_first_vertex_mm;
  const auto ending_on_axis = [&](double pupil_height, optics::Apertures apertures) {
    double low = -20, high = 20;  // the image of higher object points is lower
    optics::TracedRay ray;
    for (int step = 0; step < 60; ++step) {
      const double middle = 0.5 * (low + high);
      const optics::Vec3 from{0, middle, object_z};
      const optics::Ray start{from, optics::Vec3{0, pupil_height, pupil_z} - from};
      ray = optics::trace(perfect, start, optics::Apertures::none);
      (ray.image.y > 0 ? low : high) = middle;
      if (step == 59) ray = optics::trace(perfect, start, apertures);
    }
    return ray;
  };
  ASSERT_NEAR(ending_on_axis(0.3, optics::Apertures::none).image.y, 0, 1e-9);
  double low = 0, high = 1.2, largest_sine = 0;
  while (high - low > 1e-8) {
    const double height = 0.5 * (low + high);
    const optics::TracedRay ray = ending_on_axis(height, optics::Apertures::mesh);
    if (ray.passed) largest_sine = std::fabs(ray.exit_direction.y);
    (ray.passed ? low : high) = height;
  }
  const double centre =
      0.25 * (static_cast<double>(image[99 * 200 + 99]) + static_cast<double>(image[99 * 200 + 100]) +
              static_cast<double>(image[100 * 200 + 99]) + static_cast<double>(image[100 * 200 + 100]));
  EXPECT_NEAR(centre, 3.14159265 * largest_sine * largest_sine, 0.01 * centre);
}

}  // namespace
}  // namespace relign::imaging
