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

// Lenses at random poses, each with memory for an image.
struct Instances {
  Instances(const SceneFile& scene, std::size_t count) : images(count, std::vector<float>(scene.sensor.pixels())) {
    Random random(4);
    for (std::size_t i = 0; i < count; ++i) {
      lenses.push_back(std::make_unique<imaging::MountedLens>(scene, imaging::random_assembly(random)));
      poses.push_back(imaging::random_pose(random));
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
    EXPECT_EQ(emulated.launches(), 6);
  }
  EXPECT_EQ(emulated.allocations(), 0U);
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
