// Batches on a GPU against single images of the CPU, bit for bit: on the emulated driver, and on a GPU where there is
// one.
#include "gpu/gpu_camera.h"

#include <gmock/gmock.h>

#include <cstring>
#include <memory>
#include <thread>

#include "base/error.h"
#include "error_text.h"
#include "gpu/emulated_driver.h"
#include "images/score.h"
#include "imaging/scene_under_test.h"

namespace relign::gpu::camera {
namespace {

using imaging::MseEstimate;
using imaging::SceneFile;
using test::error_text;

const SceneFile& small_scene() {
  static const SceneFile scene = [] {
    imaging::SceneChoices choices;
    choices.pixels = 40;
    return imaging::relign_od_scene_with(choices);
  }();
  return scene;
}

std::vector<double> random_pose(const SceneFile& scene, Random& random) {
  std::vector<double> pose(scene.axes());
  for (double& value : pose) value = random.uniform();
  return pose;
}

// Lenses at random poses, each with memory for an image.
struct Instances {
  Instances(const SceneFile& scene, std::size_t count) : images(count, std::vector<float>(scene.sensor.pixels())) {
    Random random(4);
    for (std::size_t i = 0; i < count; ++i) {
      lenses.push_back(imaging::random_lens(scene, random));
      poses.push_back(random_pose(scene, random));
    }
    for (std::size_t i = 0; i < count; ++i) items.push_back({lenses[i].get(), &poses[i], 5 + i, images[i].data()});
  }
  std::vector<std::unique_ptr<imaging::MountedLens>> lenses;
  std::vector<std::vector<double>> poses;
  std::vector<std::vector<float>> images;
  std::vector<imaging::BatchItem> items;
};

void expect_bits_of_camera(Gpu& gpu, const SceneFile& scene, std::size_t count) {
  Instances instances(scene, count);
  Parallel parallel(2);
  GpuCamera on_gpu(gpu, scene, {}, parallel);
  on_gpu.capture(instances.items);
  const imaging::Reference reference{instances.images.front(), instances.images.back(), instances.images.front()};
  on_gpu.set_reference(reference);
  const std::vector<MseEstimate> mse = on_gpu.noise_free_mse(instances.items);
  imaging::Camera camera(scene, {}, parallel);
  std::vector<float> expected(scene.sensor.pixels());
  for (std::size_t i = 0; i < count; ++i) {
    camera.capture(*instances.lenses[i], instances.poses[i], 5 + i, expected.data());
    EXPECT_EQ(instances.images[i], expected) << i;
    const MseEstimate one = camera.noise_free_mse(*instances.lenses[i], instances.poses[i], 5 + i, reference);
    EXPECT_EQ(mse[i].mse, one.mse) << i;
    EXPECT_EQ(mse[i].standard_error, one.standard_error) << i;
  }
}

TEST(GpuCamera, HasTheBitsOfTheCameraOnAGpu) {
  if (const Availability found = look_for_gpu(); !found.usable) GTEST_SKIP() << found.sentence;
  Gpu gpu;
  expect_bits_of_camera(gpu, imaging::relign_od_scene(), 16);
}

TEST(GpuCamera, HasTheBitsOfTheCameraOnTheEmulatedDriver) {
  const EmulatedGpu emulated;
  EXPECT_EQ(look_for_gpu().sentence, "Emulated GPU, 1.00 GB, sm_00");
  {
    Gpu gpu;
    expect_bits_of_camera(gpu, small_scene(), 5);
    expect_bits_of_camera(gpu, small_scene(), 1);
    // Each time the seven kernels that fit tiles, for captures and for the MSE; check, clear, capture, mse.
    EXPECT_EQ(emulated.launches(), 2 * (2 * 7 + 4));
  }
  EXPECT_EQ(emulated.allocations(), 0U);
}

TEST(GpuCamera, FitsTheTilesOfEveryShippedScene) {
  const EmulatedGpu emulated;
  Gpu gpu;
  int compared = 0;
  for (const std::string& name : imaging::shipped_scenes()) {
    imaging::SceneChoices choices;
    choices.pixels = 40;
    const SceneFile scene = imaging::read_scene_file(imaging::scene_folder() + name + "/scene.json", choices);
    if (!unsupported(scene, {}).empty()) continue;
    Parallel alone(1);
    CaptureBatch here(scene, {}, alone), there(scene, {}, alone, nullptr, CaptureBatch::Tiles::fitted_by_kernels);
    const int before = emulated.launches();
    expect_bits_of_camera(gpu, scene, 2);
    const int reads_out = scene.sensor.electronics ? 1 : 0;
    EXPECT_EQ(emulated.launches() - before, (there.kernels_fit_tiles() ? 18 : 3) + reads_out) << scene.name;
    EXPECT_FALSE(here.kernels_fit_tiles());
    compared += there.kernels_fit_tiles() ? 1 : 0;
  }
  EXPECT_GT(compared, 2);
}

// Regions in direction cosines are found by the CPU.
TEST(GpuCamera, CapturesReflectionsAsThePlainLoop) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Instances instances(small_scene(), 3);
  Parallel two(2);
  const imaging::CaptureSettings settings{imaging::Transport::ghost, imaging::Sampler::paper, 16, 0.3};
  GpuCamera on_gpu(gpu, small_scene(), settings, two);
  EXPECT_FALSE(on_gpu.certifies());
  const int before = emulated.launches();
  on_gpu.capture(instances.items);
  EXPECT_EQ(emulated.launches() - before, 1);
  CaptureBatch here(small_scene(), settings, two);
  here.prepare(instances.items, CaptureBatch::Kind::capture);
  std::vector<float> expected = here.capture_here();
  std::vector<float> found;
  for (const std::vector<float>& image : instances.images) found.insert(found.end(), image.begin(), image.end());
  EXPECT_EQ(found, expected);
  EXPECT_NE(instances.images[0], instances.images[1]);
}

TEST(GpuCamera, LeavesTilesToTheCpuWhereNoPlaneHoldsTheRegions) {
  const EmulatedGpu emulated;
  Gpu gpu;
  SceneFile scene = small_scene();
  scene.lens.stops[1].opening_radius_mm = 0.2;  // the aperture
  scene.pupil = nullptr;
  Parallel alone(1);
  ASSERT_FALSE(CaptureBatch(scene, {}, alone, nullptr, CaptureBatch::Tiles::fitted_by_kernels).kernels_fit_tiles());
  const int before = emulated.launches();
  expect_bits_of_camera(gpu, scene, 2);
  EXPECT_EQ(emulated.launches() - before, 3);
}

// Batches of any lenses, some of them shared and some mounted anew, so that tables change hands.
TEST(GpuCamera, KeepsTheRegionsOfEachLens) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Parallel alone(1);
  GpuCamera on_gpu(gpu, small_scene(), {}, alone);
  imaging::Camera camera(small_scene(), {}, alone);
  Random random(8);
  Instances instances(small_scene(), 6);
  std::vector<float> expected(small_scene().sensor.pixels());
  for (int round = 0; round < 12; ++round) {
    std::vector<imaging::BatchItem> items;
    for (std::size_t i = 0; i < instances.items.size(); ++i) {
      if (random.uniform() < 0.3) instances.lenses[i] = imaging::random_lens(small_scene(), random);
      instances.poses[i] = random_pose(small_scene(), random);
      if (random.uniform() < 0.4) continue;
      imaging::BatchItem item = instances.items[i];
      item.lens = instances.lenses[random.uniform() < 0.3 ? 0 : i].get();
      items.push_back(item);
    }
    on_gpu.capture(items);
    for (const imaging::BatchItem& item : items) {
      camera.capture(*item.lens, *item.true_pose, item.seed, expected.data());
      ASSERT_TRUE(std::equal(expected.begin(), expected.end(), item.pixels)) << round;
    }
  }
}

// Regions searched in too narrow a range leave tiles black.
TEST(GpuCamera, RejectsImagesThatMissLightAsTheCpuDoes) {
  const EmulatedGpu emulated;
  Gpu gpu;
  SceneFile scene = small_scene();
  const double z = scene.sensor.z_mm + scene.pivot_behind_first_vertex_mm;
  scene.pupil = std::make_shared<optics::PupilSearch>(scene.lens, optics::PlaceRange{1, z - 0.5, z + 0.5});
  ASSERT_TRUE(scene.pupil->grid().on_plane);
  Parallel alone(1);
  GpuCamera on_gpu(gpu, scene, {}, alone);
  std::vector<float> pixels(scene.sensor.pixels());
  imaging::MountedLens lens(scene);
  const std::vector<double> pose = imaging::nominal_pose();
  const auto capture = [&] { on_gpu.capture({{&lens, &pose, 1, pixels.data()}}); };
  const std::string found = error_text(ErrorKind::internal, capture);
  EXPECT_THAT(found, testing::HasSubstr("images of this lens would miss light"));
  EXPECT_FALSE(lens.is_certified());
  EXPECT_EQ(error_text(ErrorKind::internal, capture), found) << "not only the first time";
  imaging::Camera camera(scene, {}, alone);
  EXPECT_EQ(error_text(ErrorKind::internal,
                       [&] { camera.certify(lens, pose, imaging::kFirstImageRays, imaging::kFirstImageSeed); }),
            found);
}

TEST(GpuCamera, ChecksEachLensOnce) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Instances instances(small_scene(), 3);
  Parallel alone(1);
  GpuCamera camera(gpu, small_scene(), {}, alone);
  const int before = emulated.launches();
  camera.capture({instances.items[0], instances.items[1], instances.items[0]});
  EXPECT_TRUE(instances.lenses[0]->is_certified());
  EXPECT_EQ(emulated.launches() - before, 10);
  camera.capture({instances.items[0], instances.items[1]});
  EXPECT_EQ(emulated.launches() - before, 10 + 9);
  camera.capture(instances.items);
  EXPECT_TRUE(instances.lenses[2]->is_certified());
  EXPECT_EQ(emulated.launches() - before, 10 + 9 + 10);
}

TEST(GpuCamera, CapturesIntoChosenPlacesOfMemoryOnTheGpu) {
  const EmulatedGpu emulated;
  Gpu gpu;
  const std::size_t pixels = small_scene().sensor.pixels();
  Instances instances(small_scene(), 3);
  Parallel alone(1);
  GpuCamera camera(gpu, small_scene(), {}, alone);
  camera.capture(instances.items);
  const imaging::Reference reference{instances.images[0], instances.images[1], instances.images[2]};
  camera.set_reference(reference);
  Buffer memory(gpu);
  memory.reserve(5 * pixels * sizeof(float));
  const std::vector<std::uint32_t> places = {4, 0, 2};
  const std::vector<double> rmse = camera.capture(instances.items, places, memory.as<float>());
  std::vector<float> found(pixels);
  for (std::size_t i = 0; i < places.size(); ++i) {
    memory.download(found.data(), pixels * sizeof(float), places[i] * pixels * sizeof(float));
    EXPECT_EQ(found, instances.images[i]) << i;
    EXPECT_EQ(rmse[i], images::rmse(found.data(), reference.mean.data(), pixels)) << i;
  }
  EXPECT_EQ(rmse[2], 0);
  memory.download(found.data(), pixels * sizeof(float), pixels * sizeof(float));
  std::uint32_t bits = 0;
  std::memcpy(&bits, &found[pixels / 2], sizeof bits);
  EXPECT_EQ(bits, 0xA5A5A5A5U) << "the other images are as they were";
}

TEST(GpuCamera, WorksFromAnyThread) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Instances instances(small_scene(), 1);
  Parallel alone(1);
  std::unique_ptr<GpuCamera> camera;
  std::thread([&] {
    camera = std::make_unique<GpuCamera>(gpu, small_scene(), imaging::CaptureSettings{}, alone);
  }).join();
  std::thread([&] { camera->capture(instances.items); }).join();
  std::thread([&] { camera.reset(); }).join();
  EXPECT_EQ(emulated.allocations(), 0U);
}

TEST(GpuCamera, ReportsTooLittleMemoryAndFreesWhatItHad) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Instances instances(small_scene(), 3);
  Parallel alone(1);
  GpuCamera camera(gpu, small_scene(), {}, alone);
  {
    const With little{{"EMULATED_CUDA_MEMORY", "2000000"}};  // the target's texels and little else
    EXPECT_EQ(error_text(ErrorKind::bad_input, [&] { camera.capture(instances.items); }),
              "the GPU has too little memory (cuMemAlloc); use fewer images per batch");
  }
  camera.capture(instances.items);  // the camera can still be used
  const std::vector<std::vector<float>> images = instances.images;
  Instances more(small_scene(), 20);
  for (const char* bytes :
       {"10000000", "11000000", "12000000"}) {  // for tables, for what kernels make of corners, tiles
    const With little{{"EMULATED_CUDA_MEMORY", bytes}};
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { camera.capture(more.items); }),
                testing::HasSubstr("use fewer images per batch"));
  }
  camera.capture(instances.items);
  EXPECT_EQ(instances.images, images);
  camera.capture(more.items);
  imaging::Camera on_cpu(small_scene(), {}, alone);
  on_cpu.capture(*more.lenses[19], more.poses[19], more.items[19].seed, instances.images[0].data());
  EXPECT_EQ(more.images[19], instances.images[0]);
}

TEST(GpuCamera, NamesTheFunctionOfTheDriverThatFails) {
  const EmulatedGpu emulated;
  for (const char* function : {"cuDevicePrimaryCtxRetain", "cuModuleLoadData", "cuMemAlloc", "cuMemcpyHtoD",
                               "cuLaunchKernel", "cuMemcpyDtoH"}) {
    const With failing{{"EMULATED_CUDA_FAILS", function}};
    const std::string text = error_text(ErrorKind::internal, [&] {
      Gpu gpu;
      Instances instances(small_scene(), 1);
      Parallel alone(1);
      GpuCamera(gpu, small_scene(), {}, alone).capture(instances.items);
    });
    EXPECT_EQ(text, std::string("the GPU failed: ") + function + ": unspecified launch failure");
    EXPECT_EQ(emulated.allocations(), 0U);
  }
}

TEST(GpuCamera, RefusesAReferenceOfAnotherScene) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Instances instances(small_scene(), 1);
  Parallel alone(1);
  GpuCamera camera(gpu, small_scene(), {}, alone);
  EXPECT_EQ(error_text(ErrorKind::bad_input,
                       [&] {
                         camera.set_reference({{1}, {1}, {1}});
                       }),
            "the reference has 1 pixels, the scene's sensor 1600");
}

// The emulation itself: these mistakes end a test that makes them.
TEST(EmulatedDriver, EndsAccessesOutsideKernelsAndCopies) {
  const EmulatedGpu emulated;
  Gpu gpu;
  Buffer buffer(gpu);
  buffer.reserve(100);
  EXPECT_DEATH(*buffer.as<volatile char>() = 1, "");
  char bytes[101] = "";
  EXPECT_EQ(error_text(ErrorKind::internal, [&] { buffer.download(bytes, 101); }),
            "the GPU failed: cuMemcpyDtoH: invalid argument");
  EXPECT_EQ(error_text(ErrorKind::internal, [&] { buffer.download(bytes, 100, 1); }),
            "the GPU failed: cuMemcpyDtoH: invalid argument");
  buffer.download(bytes, 100);
  EXPECT_EQ(bytes[99], '\xA5') << "memory that was not written";
}

TEST(EmulatedDriver, EndsLeaks) {
  const EmulatedGpu emulated;
  EXPECT_DEATH(
      {
        auto gpu = std::make_unique<Gpu>();
        auto* buffer = new Buffer(*gpu);
        buffer->reserve(1);
        gpu.reset();
      },
      "1 allocations were not freed");
}

}  // namespace
}  // namespace relign::gpu::camera
