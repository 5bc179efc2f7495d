// A batch on the emulated GPU against one on the CPU: the same bits everywhere but in captures with reflections.
#include "gpu/gpu.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "base/error.h"
#include "environment/batch.h"
#include "error_text.h"
#include "gpu/emulated_driver.h"

namespace relign::environment {
namespace {

using plugin_host::Kind;
using test::error_text;
using testing::HasSubstr;

class BatchOnGpu : public testing::Test {
 protected:
  BatchOnGpu() { catalog_.scan(RELIGN_PLUGIN_DIR); }

  BatchSetup setup(bool on_gpu, const std::string& scene = "relign_od", const Json& parameters = {{"pixels", 32}}) {
    BatchSetup setup;
    setup.scene = catalog_.resolve_or_throw(Kind::scene, scene, parameters);
    setup.level = catalog_.resolve_or_throw(Kind::noise_level, "tolerances-stepper-stage");
    setup.slots = 4;
    setup.threads = 2;
    setup.on_gpu = on_gpu;
    setup.cache_folder = std::getenv("XDG_CACHE_HOME") != nullptr ? std::getenv("XDG_CACHE_HOME") : testing::TempDir();
    return setup;
  }

  plugin_host::Catalog catalog_;
};

// Two batches, one of each kind, that do the same.
struct Pair {
  Pair(BatchSetup on_cpu, BatchSetup on_gpu) : cpu(std::move(on_cpu)), gpu(std::move(on_gpu)), memory(device) {
    memory.reserve(bytes(gpu.slots()));
    gpu.set_frames(memory.as<float>());
  }
  std::size_t bytes(std::size_t images) const { return images * cpu.frame_pixels() * sizeof(float); }

  void expect_equal() {
    std::vector<float> frames(gpu.slots() * gpu.frame_pixels());
    memory.download(frames.data(), bytes(gpu.slots()));
    for (unsigned slot = 0; slot < gpu.slots(); ++slot) {
      const Batch::State &here = cpu.state(slot), &there = gpu.state(slot);
      EXPECT_EQ(here.step, there.step);
      EXPECT_EQ(here.true_pose, there.true_pose);
      EXPECT_EQ(here.commanded_pose, there.commanded_pose);
      EXPECT_EQ(here.limits_low, there.limits_low);
      EXPECT_EQ(here.measured_error, there.measured_error);
      EXPECT_TRUE(std::equal(frames.begin() + static_cast<std::ptrdiff_t>(slot * gpu.frame_pixels()),
                             frames.begin() + static_cast<std::ptrdiff_t>((slot + 1) * gpu.frame_pixels()),
                             cpu.frames() + slot * cpu.frame_pixels()))
          << slot;
    }
  }

  Batch cpu, gpu;
  relign::gpu::Gpu device;
  relign::gpu::Buffer memory;
};

TEST_F(BatchOnGpu, HasTheBitsOfTheCpu) {
  const gpu::EmulatedGpu emulated;
  {
    Pair pair(setup(false), setup(true));
    EXPECT_EQ(pair.gpu.threads(), 2U);
    const auto both = [&](const auto& act) {
      act(pair.cpu);
      act(pair.gpu);
    };
    both([](Batch& batch) {
      batch.reset({{0, SeedDomain::training, 7},
                   {1, SeedDomain::training, 8},
                   {2, SeedDomain::tuning, 7},
                   {3, SeedDomain::benchmark, 1}});
    });
    pair.expect_equal();
    const std::vector<double> moves = {0.01, -0.02, 0.03, 0, 0.1, -0.1, 0.02, 0.03, 0.04, 0.05};
    both([&](Batch& batch) { batch.move_by({3, 1}, moves.data()); });
    pair.expect_equal();
    both([](Batch& batch) { batch.reset({{1, SeedDomain::training, 9}}); });
    pair.expect_equal();
    const std::vector<trials::Truth> here = pair.cpu.truths({2, 3}), there = pair.gpu.truths({2, 3});
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(here[k].mse, there[k].mse);
      EXPECT_EQ(here[k].standard_error, there[k].standard_error);
    }
    EXPECT_EQ(pair.cpu.optima({0}).front()->true_pose, pair.gpu.optima({0}).front()->true_pose);

    const std::vector<double> poses = {0.5, 0.5, 0.5, 0.5, 0.5, 0.4, 0.6, 0.5, 0.5, 0.5};
    const std::uint64_t seeds[] = {3, 4};
    std::vector<float> expected(2 * pair.cpu.frame_pixels()), found(expected.size());
    pair.cpu.capture_at({3, 0}, poses.data(), seeds, expected.data());
    gpu::Buffer images(pair.device);
    images.reserve(pair.bytes(2));
    pair.gpu.capture_at({3, 0}, poses.data(), seeds, images.as<float>());
    images.download(found.data(), pair.bytes(2));
    EXPECT_EQ(found, expected);
    pair.cpu.render_at({3, 0}, poses.data(), expected.data());
    pair.gpu.render_at({3, 0}, poses.data(), found.data());
    EXPECT_EQ(found, expected);
  }
  EXPECT_EQ(emulated.allocations(), 0U);
}

// Drawn for every capture, and once for the station.
TEST_F(BatchOnGpu, HasTheBitsOfTheCpuWithImagingErrors) {
  const gpu::EmulatedGpu emulated;
  const std::string random = std::string(RELIGN_SOURCE_DIR) + "/python/relign_bench/training/randomisation.json";
  const auto compare = [&](const std::string& scene, const Json& parameters) {
    SCOPED_TRACE(scene);
    Pair pair(setup(false, scene, parameters), setup(true, scene, parameters));
    Batch ideal(setup(false));
    for (Batch* batch : {&pair.cpu, &pair.gpu, &ideal})
      batch->reset({{0, SeedDomain::training, 7},
                    {1, SeedDomain::training, 8},
                    {2, SeedDomain::tuning, 7},
                    {3, SeedDomain::benchmark, 1}});
    pair.expect_equal();
    EXPECT_NE(pair.gpu.state(0).measured_error, ideal.state(0).measured_error);
    const std::vector<double> moves = {0.01, -0.02, 0.03, 0, 0.1, -0.1, 0.02, 0.03, 0.04, 0.05};
    for (Batch* batch : {&pair.cpu, &pair.gpu}) batch->move_by({3, 1}, moves.data());
    pair.expect_equal();
    EXPECT_EQ(pair.cpu.truths({0}).front().mse, pair.gpu.truths({0}).front().mse);
    EXPECT_EQ(pair.gpu.truths({0}).front().mse, ideal.truths({0}).front().mse);
  };
  compare("relign_od", {{"pixels", 32}, {"imaging_errors", random}});
  compare("relign_od-sensor", {{"pixels", 32}});
}

// Their captures have the distribution of the CPU's (gpu/ghost_kernel.h), their truths its bits.
TEST_F(BatchOnGpu, CapturesReflections) {
  const gpu::EmulatedGpu emulated;
  const Json parameters = {{"pixels", 32}};
  Pair pair(setup(false, "relign_od-package", parameters), setup(true, "relign_od-package", parameters));
  for (Batch* batch : {&pair.cpu, &pair.gpu}) {
    batch->reset({{0, SeedDomain::training, 7},
                  {1, SeedDomain::training, 8},
                  {2, SeedDomain::tuning, 7},
                  {3, SeedDomain::benchmark, 1}});
    const std::vector<double> moves = {0.01, -0.02, 0.03, 0, 0.1};
    batch->move_by({3}, moves.data());
  }
  std::vector<float> frames(pair.gpu.slots() * pair.gpu.frame_pixels());
  pair.memory.download(frames.data(), pair.bytes(pair.gpu.slots()));
  for (unsigned slot = 0; slot < pair.gpu.slots(); ++slot) {
    EXPECT_EQ(pair.cpu.state(slot).true_pose, pair.gpu.state(slot).true_pose);
    EXPECT_NEAR(pair.cpu.state(slot).measured_error, pair.gpu.state(slot).measured_error,
                0.1 * pair.cpu.state(slot).measured_error);
    EXPECT_EQ(pair.cpu.truths({slot}).front().mse, pair.gpu.truths({slot}).front().mse);
    const auto first = frames.begin() + static_cast<std::ptrdiff_t>(slot * pair.gpu.frame_pixels());
    EXPECT_GT(*std::max_element(first, first + static_cast<std::ptrdiff_t>(pair.gpu.frame_pixels())), 0);
  }
}

TEST_F(BatchOnGpu, RefusesWhatCannotRunThere) {
  const auto refusal = [&](const std::string& scene, const Json& parameters) {
    return error_text(ErrorKind::bad_input, [&] { Batch batch(setup(true, scene, parameters)); });
  };
  {
    const gpu::With none{{"RELIGN_LIBCUDA", "/none/libcuda.so.1"}};
    EXPECT_THAT(refusal("relign_od", {{"pixels", 32}}), HasSubstr("no NVIDIA driver: /none/libcuda.so.1: "));
  }
  const gpu::EmulatedGpu emulated;
  EXPECT_EQ(refusal("relign_od", {{"pixels", 32}, {"sampler", "lattice"}}),
            "scene 'relign_od': the GPU simulator does not support samplers other than 'paper'");
  EXPECT_EQ(refusal("gaussian_spot", {}), "the scene has no GPU simulator");
  Batch batch(setup(true));
  EXPECT_EQ(error_text(ErrorKind::bad_input,
                       [&] {
                         batch.reset({{0, SeedDomain::training, 7}});
                       }),
            "the batch has no memory of the GPU for its frames; call set_frames first");
}

}  // namespace
}  // namespace relign::environment
