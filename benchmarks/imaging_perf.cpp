// Captures, noise-free MSE and their parts on relign_od. Names state transport, sampler and threads; counters give rays
// per second.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <relign/random.hpp>
#include <string>
#include <thread>
#include <vector>

#include "gpu/capture_batch.h"
#include "imaging/camera.h"
#include "imaging/camera_batch.h"
#include "imaging/own_optimum.h"
#include "imaging/reference.h"
#include "imaging/scene_file.h"
#include "optics/ray_block.h"

namespace {

namespace imaging = relign::imaging;
namespace optics = relign::optics;

const imaging::SceneFile& scene() {
  static const imaging::SceneFile file = imaging::read_scene_file(RELIGN_OD_SCENE, {});
  return file;
}

// The last two elements are tilted, so that no change of frame is skipped.
optics::Assembly tilted() {
  return optics::Assembly(scene().lens, {{"L3", {{0.0002, -0.0001, 0.0001}, {0.4, -0.3}}},
                                         {"L4", {{-0.0001, 0.0002, 0.0001}, {-0.5, 0.2}}}});
}

const std::vector<double>& pose() {
  static const std::vector<double> near_nominal = {0.52, 0.49, 0.5, 0.53, 0.48};
  return near_nominal;
}

constexpr double kSensorAlbedo = 0.5;  // used by transport ghost only

void capture(benchmark::State& state, imaging::Sampler sampler, imaging::Transport transport, int samples) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(scene(), {transport, sampler, samples, kSensorAlbedo}, parallel);
  imaging::MountedLens lens(scene(), tilted());
  std::vector<float> image(40000);
  std::uint64_t seed = 0;
  for (auto _ : state) camera.capture(lens, pose(), seed++, image.data());
}
BENCHMARK_CAPTURE(capture, paper_noise_fresnel, imaging::Sampler::paper, imaging::Transport::fresnel, 64)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(capture, paper_noise_ghost, imaging::Sampler::paper, imaging::Transport::ghost, 64)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(capture, paper_noise_refract, imaging::Sampler::paper, imaging::Transport::refract, 64)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(capture, pupil64_fresnel, imaging::Sampler::pupil, imaging::Transport::fresnel, 64)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(capture, hemisphere_fresnel, imaging::Sampler::hemisphere, imaging::Transport::fresnel, 64)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// A capture with its derivatives: by the pose (parts 0), or by every element's six motions, against the same capture.
// Goals: 2.5 and 8 times the capture.
void capture_derivatives(benchmark::State& state, imaging::Sampler sampler, bool elements) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(scene(), {imaging::Transport::fresnel, sampler, 64}, parallel);
  imaging::MountedLens lens(scene(), tilted());
  imaging::MovingParts parts;
  if (elements) parts = {false, {0, 1, 2, 3}};
  std::vector<float> image(40000), derivatives(image.size() * 6 * parts.count());
  std::uint64_t seed = 0;
  for (auto _ : state) camera.render_derivatives(lens, pose(), seed++, 0, 0, parts, image.data(), derivatives.data());
}
BENCHMARK_CAPTURE(capture_derivatives, paper_noise_pose, imaging::Sampler::paper, false)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(capture_derivatives, pupil64_pose, imaging::Sampler::pupil, false)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(capture_derivatives, pupil64_elements, imaging::Sampler::pupil, true)
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// 1920 x 1280 pixels with electronics, as the preset camera_2mp takes them. Goal: 500 ms on two cores.
void capture_2mp(benchmark::State& state) {
  const imaging::SceneFile camera_2mp = imaging::read_scene_file(RELIGN_CAMERA_2MP_SCENE, {});
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(camera_2mp, {imaging::Transport::fresnel, imaging::Sampler::pupil, 8}, parallel);
  imaging::MountedLens lens(camera_2mp);
  std::vector<float> image(camera_2mp.sensor.pixels());
  std::uint64_t seed = 0;
  for (auto _ : state) camera.capture(lens, pose(), seed++, image.data());
}
BENCHMARK(capture_2mp)->Arg(1)->Arg(2)->ArgName("threads")->Unit(benchmark::kMillisecond)->UseRealTime();

// Nine regions of 128 x 128 of these pixels, as field-focus or a station's camera reads them out.
void capture_2mp_regions(benchmark::State& state) {
  const imaging::SceneFile camera_2mp = imaging::read_scene_file(RELIGN_CAMERA_2MP_SCENE, {});
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(camera_2mp, {imaging::Transport::fresnel, imaging::Sampler::pupil, 8}, parallel);
  imaging::MountedLens lens(camera_2mp);
  relign::PixelRegions regions;
  for (const unsigned column : {100, 896, 1692})
    for (const unsigned row : {80, 576, 1072}) regions.push_back({column, row, 128, 128});
  std::vector<float> image(camera_2mp.sensor.pixels());
  std::uint64_t seed = 0;
  for (auto _ : state) camera.capture_regions(lens, pose(), seed++, regions, image.data());
}
BENCHMARK(capture_2mp_regions)->Arg(1)->Arg(2)->ArgName("threads")->Unit(benchmark::kMillisecond)->UseRealTime();

// A phone lens of six steep aspheres, 120 x 120 pixels (tests/simulator/imaging/phone), and its rays through all faces.
void capture_phone(benchmark::State& state) {
  const imaging::SceneFile phone = imaging::read_scene_file(RELIGN_PHONE_SCENE, {});
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(phone, {}, parallel);
  imaging::MountedLens lens(phone);
  std::vector<float> image(phone.sensor.pixels());
  std::uint64_t seed = 0;
  camera.capture(lens, pose(), seed, image.data());  // computes the importance regions
  for (auto _ : state) camera.capture(lens, pose(), seed++, image.data());
}
BENCHMARK(capture_phone)->Arg(1)->Arg(2)->ArgName("threads")->Unit(benchmark::kMillisecond)->UseRealTime();

// Work done once per lens as built: importance regions and the check of its first image.
void mount_phone(benchmark::State& state) {
  const imaging::SceneFile phone = imaging::read_scene_file(RELIGN_PHONE_SCENE, {});
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(phone, {}, parallel);
  for (auto _ : state) {
    imaging::MountedLens lens(phone);
    camera.certify(lens, pose(), {0, 24, 512}, 1);
  }
}
BENCHMARK(mount_phone)->Arg(1)->Arg(2)->ArgName("threads")->Unit(benchmark::kMillisecond)->UseRealTime();

// The check of a lens's first image, without computing importance regions: part of the cost of every trial.
void certify(benchmark::State& state) {
  relign::Parallel parallel(1);
  imaging::Camera camera(scene(), {}, parallel);
  imaging::MountedLens lens(scene(), tilted());
  for (auto _ : state) camera.certify(lens, pose(), {0, 24, 512}, 1);
}
BENCHMARK(certify)->Unit(benchmark::kMillisecond)->UseRealTime();

// The best pose of a lens as built, and its noise-free MSE.
void own_optimum(benchmark::State& state) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  const imaging::Reference reference = imaging::make_reference(scene(), {}, parallel, {}, {});
  imaging::Camera camera(scene(), {}, parallel);
  imaging::OptimumFinder finder(scene(), {}, camera, parallel, reference);
  imaging::MountedLens lens(scene(), tilted());
  std::uint64_t seed = 0;
  for (auto _ : state) benchmark::DoNotOptimize(finder.find(lens, seed++));
}
BENCHMARK(own_optimum)->Arg(1)->Arg(2)->ArgName("threads")->Unit(benchmark::kMillisecond)->UseRealTime();

void truth(benchmark::State& state) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  const imaging::Reference reference = imaging::make_reference(scene(), {}, parallel, {}, {});
  imaging::Camera camera(scene(), {}, parallel);
  imaging::MountedLens lens(scene());
  std::uint64_t seed = 0;
  double error = 0;
  const std::vector<double> nominal(5, 0.5);
  for (auto _ : state) error = camera.noise_free_mse(lens, nominal, seed++, reference).standard_error;
  state.counters["standard_error"] = error;
}
BENCHMARK(truth)
    ->Name("truth_fresnel")
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// The same with its gradient and Gauss-Newton matrix. Goal: three times as long.
void noise_free_mse_slopes(benchmark::State& state) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::Camera camera(scene(), {}, parallel);
  imaging::MountedLens lens(scene(), tilted());
  const imaging::Reference reference = imaging::make_reference(scene(), {}, parallel, {}, {});
  std::uint64_t seed = 0;
  imaging::MseSlopes slopes;
  for (auto _ : state) benchmark::DoNotOptimize(camera.noise_free_mse(lens, pose(), seed++, reference, slopes));
}
BENCHMARK(noise_free_mse_slopes)->Arg(1)->Arg(2)->ArgName("threads")->Unit(benchmark::kMillisecond)->UseRealTime();

// 16 poses of each of 4 assemblies in one call.
void batch(benchmark::State& state) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  imaging::CameraBatch cameras(scene(), {}, parallel);
  std::vector<std::unique_ptr<imaging::MountedLens>> lenses;
  std::vector<std::vector<double>> poses;
  std::vector<std::vector<float>> images(64, std::vector<float>(40000));
  std::vector<imaging::BatchItem> items;
  relign::Random random(4);
  for (int i = 0; i < 4; ++i) lenses.push_back(std::make_unique<imaging::MountedLens>(scene(), tilted()));
  for (int i = 0; i < 64; ++i) {
    poses.emplace_back(5);
    for (double& value : poses.back()) value = random.uniform(0.4, 0.6);
  }
  for (std::size_t i = 0; i < 64; ++i) items.push_back({lenses[i / 16].get(), &poses[i], i, images[i].data()});
  cameras.capture(items);
  for (auto _ : state) cameras.capture(items);
  state.counters["frames"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * 64, benchmark::Counter::kIsRate);
}
BENCHMARK(batch)
    ->Name("batch_of_64_paper_noise_fresnel")
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// What the CPU does for a batch of 64 images on a GPU: with the tiles, or only the paths of lenses; with reflections.
void prepare(benchmark::State& state, relign::gpu::CaptureBatch::Tiles tiles, imaging::Transport transport) {
  relign::Parallel alone(1);
  imaging::MountedLens lens(scene(), tilted());
  const std::vector<imaging::BatchItem> items(64, {&lens, &pose(), 1, nullptr});
  imaging::CaptureSettings settings;
  settings.transport = transport;
  relign::gpu::CaptureBatch batch(scene(), settings, alone, nullptr, tiles);
  for (auto _ : state) batch.prepare(items, relign::gpu::CaptureBatch::Kind::capture);
}
using Tiles = relign::gpu::CaptureBatch::Tiles;
BENCHMARK_CAPTURE(prepare, tiles, Tiles::fitted_here, imaging::Transport::fresnel)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(prepare, paths, Tiles::fitted_by_kernels, imaging::Transport::fresnel)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(prepare, ghosts, Tiles::fitted_by_kernels, imaging::Transport::ghost)->Unit(benchmark::kMicrosecond);

// The part of a new lens that the CPU keeps when kernels find its regions.
void mount_only(benchmark::State& state) {
  const optics::Assembly assembly = tilted();
  for (auto _ : state) benchmark::DoNotOptimize(imaging::MountedLens(scene(), assembly).identity().get());
}
BENCHMARK(mount_only)->Unit(benchmark::kMicrosecond);

// A new assembly and its first capture, as every trial begins.
void mount(benchmark::State& state) {
  relign::Parallel parallel(static_cast<unsigned>(state.range(0)));
  std::vector<float> image(40000);
  for (auto _ : state) {
    imaging::Camera camera(scene(), {}, parallel);
    imaging::MountedLens lens(scene(), tilted());
    camera.capture(lens, pose(), 1, image.data());
  }
}
BENCHMARK(mount)
    ->Name("mount_and_first_capture")
    ->Arg(1)
    ->Arg(2)
    ->ArgName("threads")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// One block of 256 rays through the whole tilted lens, already in the cache: the lower bound of everything above. One
// instruction set each; results have the same bits.
void trace_block(benchmark::State& state, const char* isa, bool fresnel) {
  const optics::BlockKernels* kernels = optics::block_kernels(isa);
  if (!kernels) {
    state.SkipWithError("this processor lacks the instruction set");
    return;
  }
  const optics::Assembly assembly = tilted();
  const optics::BackwardPath path = optics::backward_path(assembly, scene().lens_to_world(pose()));
  const optics::Vec3 start = path.into_first_frame.point({0.3, 0.2, scene().sensor.z_mm});
  const auto fresh = std::make_unique<optics::RayBlock>();
  for (int i = 0; i < optics::kBlockRays; ++i) {
    const optics::Vec3 direction =
        path.into_first_frame.direction(optics::unit({0.2 * (i % 16 - 7.5) / 8, 0.2 * (i / 16 - 7.5) / 8, -1}));
    fresh->x[i] = static_cast<float>(start.x);
    fresh->y[i] = static_cast<float>(start.y);
    fresh->z[i] = static_cast<float>(start.z);
    fresh->lx[i] = static_cast<float>(direction.x);
    fresh->ly[i] = static_cast<float>(direction.y);
    fresh->lz[i] = static_cast<float>(direction.z);
    fresh->above[i] = fresh->below[i] = fresh->margin[i] = 1;
  }
  const auto block = std::make_unique<optics::RayBlock>();
  for (auto _ : state) {
    *block = *fresh;
    kernels->trace(*block, path.ops.data(), static_cast<int>(path.ops.size()), fresnel, optics::kBlockRays);
    benchmark::DoNotOptimize(block->margin);
  }
  state.counters["rays"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * optics::kBlockRays, benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(trace_block, avx512_fresnel, "avx512", true);
BENCHMARK_CAPTURE(trace_block, avx2_fresnel, "avx2", true);
BENCHMARK_CAPTURE(trace_block, avx512_refract, "avx512", false);
BENCHMARK_CAPTURE(trace_block, avx2_refract, "avx2", false);

}  // namespace
