// What is said about GPUs and drivers; and, where there is a GPU, that its images have the CPU's bits.
#include "gpu/gpu.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "base/error.h"
#include "gpu/gpu_camera.h"
#include "imaging/scene_under_test.h"

namespace relign::gpu::device {
namespace {

using testing::HasSubstr;

// Environment variables for the length of a test.
class With {
 public:
  With(std::initializer_list<std::pair<const char*, const char*>> values) {
    for (const auto& [name, value] : values) {
      names_.push_back(name);
      ::setenv(name, value, 1);
    }
  }
  ~With() {
    for (const char* name : names_) ::unsetenv(name);
  }
  With(const With&) = delete;
  With& operator=(const With&) = delete;

 private:
  std::vector<const char*> names_;
};

TEST(LookForGpu, NamesAMissingDriver) {
  const With none{{"RELIGN_LIBCUDA", "/none/libcuda.so.1"}};
  const Availability found = look_for_gpu();
  EXPECT_FALSE(found.usable);
  EXPECT_THAT(found.sentence, HasSubstr("no NVIDIA driver: /none/libcuda.so.1: "));
  EXPECT_THROW(Gpu(), Error);
}

TEST(LookForGpu, NamesADriverWithoutTheFunctions) {
  const With other{{"RELIGN_LIBCUDA", "libm.so.6"}};
  EXPECT_EQ(look_for_gpu().sentence, "the NVIDIA driver is too old: 'libm.so.6' has no function 'cuInit'");
}

TEST(LookForGpu, NamesAnOldDriver) {
  const With old{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER}, {"FAKE_CUDA_VERSION", "11080"}};
  EXPECT_EQ(
      look_for_gpu().sentence,
      "the NVIDIA driver is too old: it supports CUDA 11.8, the simulator needs 12.0 or later; update the driver");
}

TEST(LookForGpu, NamesADriverWithoutGpu) {
  {
    const With none{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER}, {"FAKE_CUDA_INIT", "100"}};
    EXPECT_EQ(look_for_gpu().sentence, "the NVIDIA driver finds no GPU");
  }
  {
    const With none{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER}, {"FAKE_CUDA_GPUS", "0"}};
    EXPECT_EQ(look_for_gpu().sentence, "the NVIDIA driver finds no GPU");
  }
  const With broken{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER}, {"FAKE_CUDA_INIT", "999"}};
  EXPECT_EQ(look_for_gpu().sentence, "the NVIDIA driver does not start: unknown error");
}

TEST(LookForGpu, NamesTheGpuWhoseCompilerIsMissing) {
  const With fake{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER},
                  {"RELIGN_LIBNVRTC", "/none/libnvrtc.so"},
                  {"XDG_CACHE_HOME", "/proc/none"}};
  const Availability found = look_for_gpu();
  EXPECT_FALSE(found.usable);
  EXPECT_THAT(found.sentence, HasSubstr("Made-up GPU, 80.0 GB, sm_90, but NVIDIA's compiler NVRTC was not found"));
}

TEST(Gpu, ReportsTheCallThatFailed) {
  const With fake{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER}};
  if (const Availability found = look_for_gpu(); !found.usable) GTEST_SKIP() << found.sentence;
  try {
    Gpu();
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the GPU failed: cuDevicePrimaryCtxRetain: unknown error");
  }
}

TEST(Gpu, CapturesAndScoresWithTheBitsOfTheCamera) {
  if (const Availability found = look_for_gpu(); !found.usable) GTEST_SKIP() << found.sentence;
  Gpu gpu;
  const imaging::SceneFile& scene = imaging::relign_od_scene();
  Parallel parallel(2);
  Random random(4);
  std::vector<std::unique_ptr<imaging::MountedLens>> lenses;
  std::vector<std::vector<double>> poses;
  std::vector<std::vector<float>> images(16, std::vector<float>(scene.sensor.pixels()));
  for (std::size_t i = 0; i < images.size(); ++i) {
    lenses.push_back(std::make_unique<imaging::MountedLens>(scene, imaging::random_assembly(random)));
    poses.push_back(imaging::random_pose(random));
  }
  std::vector<imaging::BatchItem> items;
  for (std::size_t i = 0; i < images.size(); ++i)
    items.push_back({lenses[i].get(), &poses[i], 5 + i, images[i].data()});
  GpuCamera on_gpu(gpu, scene, {}, parallel);
  on_gpu.capture(items);
  imaging::Camera camera(scene, {}, parallel);
  const imaging::Reference reference{images[0], images[1], images[0]};
  const std::vector<imaging::MseEstimate> mse = on_gpu.noise_free_mse(items, reference);
  std::vector<float> expected(scene.sensor.pixels());
  for (std::size_t i = 0; i < images.size(); ++i) {
    camera.capture(*lenses[i], poses[i], 5 + i, expected.data());
    EXPECT_EQ(images[i], expected) << i;
    const imaging::MseEstimate one = camera.noise_free_mse(*lenses[i], poses[i], 5 + i, reference);
    EXPECT_EQ(mse[i].mse, one.mse) << i;
    EXPECT_EQ(mse[i].standard_error, one.standard_error) << i;
  }
}

}  // namespace
}  // namespace relign::gpu::device
