// What is said about GPUs and drivers.
#include "gpu/gpu.h"

#include <gmock/gmock.h>

#include "base/error.h"
#include "gpu/emulated_driver.h"

namespace relign::gpu::device {
namespace {

using testing::HasSubstr;

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

TEST(LookForGpu, NamesACompilerThatIsNewerThanTheDriver) {
  const With older{{"RELIGN_LIBCUDA", RELIGN_FAKE_DRIVER},
                   {"RELIGN_LIBNVRTC", RELIGN_EMULATED_DRIVER},
                   {"FAKE_CUDA_VERSION", "12040"},
                   {"EMULATED_NVRTC_MAJOR", "13"},
                   {"XDG_CACHE_HOME", "/proc/none"}};
  EXPECT_EQ(look_for_gpu().sentence,
            "Made-up GPU, 80.0 GB, sm_90, but NVIDIA's compiler '" RELIGN_EMULATED_DRIVER
            "' is of CUDA 13.0, and the driver cannot run its code; update the driver, or set RELIGN_LIBNVRTC to the "
            "libnvrtc.so of CUDA 12");
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

}  // namespace
}  // namespace relign::gpu::device
