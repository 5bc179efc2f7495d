// A phone lens: steep aspheres, a last face that bends back, chief rays of 30 degrees at the sensor. Its importance
// regions are in direction cosines, and for many hits a few Newton steps prove nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "exact_rays.h"
#include "optics/pupil_search.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using testing::HasSubstr;

SceneFile phone() {
  static const SceneFile scene =
      read_scene_file(std::string(RELIGN_SOURCE_DIR) + "/tests/simulator/imaging/phone/scene.json", {});
  return scene;
}

SceneFile white_phone() {
  SceneFile scene = phone();
  scene.emitter.show(images::Image(2, 2, 1.0F));
  return scene;
}

images::Image noise_free(const SceneFile& scene, Transport transport, int samples) {
  Parallel parallel(2);
  CaptureSettings settings;
  settings.transport = transport;
  Camera camera(scene, settings, parallel);
  MountedLens lens(scene);
  images::Image image(static_cast<std::size_t>(scene.sensor.width), static_cast<std::size_t>(scene.sensor.height));
  camera.render_noise_free(lens, nominal_pose(), 5, samples, image.values.data());
  return image;
}

optics::Assembly with_offsets(const SceneFile& scene, Random& random) {
  std::map<std::string, optics::ElementOffset> offsets;
  for (const optics::Element& element : scene.lens.elements)
    offsets[element.name] = {{0.005 * random.normal(), 0.005 * random.normal(), 0.005 * random.normal()},
                             {0.1 * random.normal(), 0.1 * random.normal()}};
  return optics::Assembly(scene.lens, offsets);
}

TEST(PhoneLens, UsesDirectionCosines) {
  EXPECT_FALSE(phone().pupil->grid().on_plane);
  EXPECT_TRUE(relign_od_scene().pupil->grid().on_plane);
}

// Symmetric light stays symmetric; detects tiles that miss light in one quadrant only.
TEST(PhoneLens, ImageIsSymmetricUnderQuarterTurn) {
  const images::Image image = noise_free(white_phone(), Transport::fresnel, 512);
  constexpr std::size_t kBlock = 8;
  const std::size_t blocks = image.width / kBlock;
  const auto mean = [&](std::size_t column, std::size_t row) {
    double sum = 0;
    for (std::size_t y = 0; y < kBlock; ++y)
      for (std::size_t x = 0; x < kBlock; ++x)
        sum += static_cast<double>(image.at(column * kBlock + x, row * kBlock + y));
    return sum / (kBlock * kBlock);
  };
  double whole = 0, worst = 0;
  for (std::size_t row = 0; row < blocks; ++row)
    for (std::size_t column = 0; column < blocks; ++column) {
      whole += mean(column, row) / static_cast<double>(blocks * blocks);
      worst = std::max(worst, std::fabs(mean(column, row) - mean(blocks - 1 - row, column)));
    }
  EXPECT_GT(whole, 0.02);
  EXPECT_LT(worst, 0.03 * whole);
}

// Energy and relative illumination against single rays in double, without tiles and regions.
TEST(PhoneLens, MatchesIrradianceOfExactRays) {
  SceneFile scene = white_phone();
  scene.emitter.side_mm *= 4;  // its border is outside the image
  const optics::Prescription turned = turned_round(scene);
  const optics::Assembly behind(turned);
  const images::Image image = noise_free(scene, Transport::refract, 1024);
  for (const double height_mm : {0.1, 0.8, 1.5, 2.0, 2.3}) {
    double sum = 0;
    int pixels = 0;
    for (std::size_t y = 0; y < image.height; ++y)
      for (std::size_t x = 0; x < image.width; ++x) {
        const optics::Vec3 at = scene.sensor.place(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
        if (std::fabs(std::hypot(at.x, at.y) - height_mm) > 0.7 * scene.sensor.pitch_mm) continue;
        sum += static_cast<double>(image.at(x, y));
        ++pixels;
      }
    const double exact = exact_irradiance(behind, height_mm, optics::Apertures::mesh, false);
    EXPECT_NEAR(sum / pixels / exact, 1, 0.01) << height_mm << " mm";
  }
}

TEST(PhoneLens, ImagesAreCertifiedAnywhereInTheTravel) {
  const SceneFile scene = white_phone();
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  Random random(5);
  for (int draw = 0; draw < 6; ++draw) {
    MountedLens lens(scene, with_offsets(scene, random));
    EXPECT_NO_THROW(camera.certify(lens, random_pose(random), {1, 0, 512}, 9));
  }
}

// Same bits on every instruction set: the slow path is shared, and the number of steps before it is equal.
TEST(PhoneLens, HasTheSameBitsOnEveryInstructionSet) {
  const SceneFile scene = phone();
  const optics::BackwardPath path = optics::backward_path(optics::Assembly(scene.lens), {});
  const auto traced = [&](const optics::BlockKernels& kernels) {
    std::vector<float> values;
    Random random(2);
    auto block = std::make_unique<optics::RayBlock>();
    for (int repeat = 0; repeat < 40; ++repeat) {
      for (int i = 0; i < optics::kBlockRays; ++i) {
        const optics::Vec3 place =
            path.into_first_frame.point({random.uniform(-2.8, 2.8), random.uniform(-2.8, 2.8), 4.0});
        const optics::Vec3 direction =
            path.into_first_frame.direction(optics::unit({random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9), -1}));
        optics::put_ray(*block, i, place, direction);
      }
      kernels.trace(*block, path.ops.data(), static_cast<int>(path.ops.size()), true, optics::kBlockRays);
      for (int i = 0; i < optics::kBlockRays; ++i) {
        values.push_back(block->margin[i] > 0 ? 1.0F : 0.0F);
        if (block->margin[i] > 0)
          values.insert(values.end(), {block->x[i], block->y[i], block->lx[i], block->above[i]});
      }
    }
    return values;
  };
  const std::vector<float> expected = traced(*optics::block_kernels("generic"));
  EXPECT_GT(expected.size(), 40u * optics::kBlockRays + 1500) << "many pass";
  for (const char* name : {"avx2", "avx512"}) {
    const optics::BlockKernels* kernels = optics::block_kernels(name);
    if (!kernels) continue;
    EXPECT_EQ(traced(*kernels), expected) << name;
  }
}

// Blocks pass exactly the rays that the double tracer passes, with the same hits.
TEST(PhoneLens, BlocksMatchSingleRays) {
  const SceneFile scene = phone();
  const optics::Assembly assembly(scene.lens);
  const optics::BackwardPath path = optics::backward_path(assembly, {});
  Random random(3);
  auto block = std::make_unique<optics::RayBlock>();
  int passed = 0, differ = 0;
  double farthest = 0;
  for (int repeat = 0; repeat < 60; ++repeat) {
    std::vector<optics::TracedRay> exact;
    std::vector<optics::Ray> starts;
    for (int i = 0; i < optics::kBlockRays; ++i) {
      // Forwards in double from the object side, backwards from where that ends.
      const optics::Ray start{{random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9), -0.3},
                              {random.uniform(-0.75, 0.75), random.uniform(-0.75, 0.75), 1}};
      const optics::TracedRay free = optics::trace(assembly, start, optics::Apertures::none);
      starts.push_back(start);
      exact.push_back(optics::trace(assembly, start, optics::Apertures::mesh));
      const optics::Vec3 p = path.into_first_frame.point(free.passed ? free.image : optics::Vec3{0, 0, 4});
      const optics::Vec3 d =
          path.into_first_frame.direction(free.passed ? -1.0 * free.exit_direction : optics::Vec3{0.99, 0, -0.1});
      optics::put_ray(*block, i, p, d);
    }
    optics::block_kernels().trace(*block, path.ops.data(), static_cast<int>(path.ops.size()), false,
                                  optics::kBlockRays);
    for (int i = 0; i < optics::kBlockRays; ++i) {
      const auto at = static_cast<std::size_t>(i);
      differ += (block->margin[i] > 0) != exact[at].passed ? 1 : 0;
      if (!(block->margin[i] > 0) || !exact[at].passed) continue;
      ++passed;
      const optics::Vec3 here = path.world_of_last_frame.point(
          {static_cast<double>(block->x[i]), static_cast<double>(block->y[i]), static_cast<double>(block->z[i])});
      const optics::Vec3 way = optics::unit(starts[at].direction);
      const optics::Vec3 from = here - starts[at].start;
      const optics::Vec3 beside = from - optics::dot(from, way) * way;
      farthest = std::max(farthest, std::sqrt(optics::dot(beside, beside)));
    }
  }
  EXPECT_GT(passed, 1000);
  EXPECT_LE(differ, passed / 500) << "rays at an edge, within float's rounding";
  EXPECT_LT(farthest, 1e-4);
}

// Fresnel factors of many faces must not overflow. Twenty plates in front of the sensor transmit (0.96^2)^20.
TEST(ManyFaces, TransmitTheProductOfFresnelFactors) {
  SceneFile scene = read_scene_file(scene_folder() + "cooke_triplet/scene.json", {});
  scene.emitter.show(images::Image(2, 2, 1.0F));
  const auto middle = [](const SceneFile& of) {
    const images::Image image = noise_free(of, Transport::fresnel, 256);
    double sum = 0;
    for (std::size_t y = image.height / 2 - 5; y < image.height / 2 + 5; ++y)
      for (std::size_t x = image.width / 2 - 5; x < image.width / 2 + 5; ++x)
        sum += static_cast<double>(image.at(x, y)) / 100;
    return sum;
  };
  const double without = middle(scene);
  constexpr int kPlates = 20;
  const double last = scene.lens.elements.back().faces.back().z_mm;
  scene.lens.barrel.reset();
  for (int i = 0; i < kPlates; ++i) {
    optics::Face front, back;
    front.z_mm = last + 3 + i;
    front.index_after = 1.5;
    back.z_mm = front.z_mm + 0.02;  // thin: the image hardly moves
    front.clear_radius_mm = back.clear_radius_mm = 30;
    scene.lens.elements.push_back({"P" + std::to_string(i), {front, back}, {}});
  }
  scene.pupil.reset();
  EXPECT_NEAR(middle(scene) / without / std::pow(0.96, 2 * kPlates), 1, 0.02);
}

// Irradiance falls with the square of the f-number. Pupils too narrow to be found everywhere, and a closed stop, give
// an error instead of an image with black areas.
TEST(SlowLens, IsCorrectOrRejected) {
  const auto stopped_down = [](double factor) {
    SceneFile scene = read_scene_file(scene_folder() + "cooke_triplet/scene.json", {});
    scene.emitter.show(images::Image(2, 2, 1.0F));
    for (optics::Stop& stop : scene.lens.stops) stop.opening_radius_mm *= factor;
    scene.pupil.reset();
    return scene;
  };
  const auto middle = [](const SceneFile& scene) {
    const images::Image image = noise_free(scene, Transport::refract, 64);
    double sum = 0;
    for (std::size_t i = 0; i < 20; ++i) sum += static_cast<double>(image.at(90 + i, 100)) / 20;
    return sum;
  };
  const double f50 = middle(stopped_down(0.1));
  EXPECT_NEAR(middle(stopped_down(0.025)) / f50, 0.0625, 0.0625 * 0.02) << "f/200";
  Parallel parallel(2);
  for (const double factor : {2e-3, 1e-5})
    EXPECT_THROW(make_reference(stopped_down(factor), {}, parallel, {}, {}), Error) << factor;
}

// Regions searched in too narrow a range leave tiles black; the certificate must detect that.
TEST(Certificate, RejectsImagesThatMissLight) {
  SceneFile scene = white_phone();
  scene.pupil = std::make_shared<optics::PupilSearch>(scene.lens, optics::PlaceRange{0.5, 3.8, 4.2});
  Parallel parallel(1);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  for (const CertificateRays& rays : {CertificateRays{}, CertificateRays{0, 24, 512}}) {
    try {
      camera.certify(lens, nominal_pose(), rays, 1);
      FAIL() << "an image with black tiles";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("images of this lens would miss light"));
      EXPECT_THAT(error.what(), HasSubstr("mm on the sensor)"));
      EXPECT_EQ(error.kind(), ErrorKind::internal);
    }
  }
}

TEST(Certificate, AcceptsEveryShippedScene) {
  for (const std::string& name : shipped_scenes()) {
    const SceneFile scene = read_scene_file(scene_folder() + name + "/scene.json", {});
    Parallel parallel(2);
    Camera camera(scene, {}, parallel);
    MountedLens lens(scene);
    EXPECT_NO_THROW(camera.certify(lens, std::vector<double>(scene.axes(), 0.5), {0, 200, 1024}, 4)) << name;
  }
}

}  // namespace
}  // namespace relign::imaging
