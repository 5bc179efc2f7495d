// relign-bench-gpu SCENE_FILE [ERRORS_FILE]: images and noise-free MSE of a GPU against the CPU's, bit for bit and in
// law, and their times, as rows of docs/performance.md; captures with the imaging errors of a file, too. Needs a GPU;
// run it by hand (benchmarks/gpu_bundle.sh). Exit status 1 if anything differs in law.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <relign/random.hpp>
#include <vector>

#include "base/machine.h"
#include "gpu/gpu_camera.h"
#include "imaging/capture_errors.h"
#include "imaging/reference.h"

namespace {

using namespace relign;
using imaging::BatchItem;
using imaging::MountedLens;

// Lenses with tilted and displaced elements, so that no change of frame is skipped, at random poses.
struct Instances {
  Instances(const imaging::SceneFile& scene, std::size_t lens_count, std::size_t image_count) {
    Random random(30);
    for (std::size_t i = 0; i < lens_count; ++i) {
      std::map<std::string, optics::ElementOffset> offsets;
      for (const optics::Element& element : scene.lens.elements)
        offsets[element.name] = {{2.5e-4 * random.normal(), 2.5e-4 * random.normal(), 2.5e-4 * random.normal()},
                                 {0.3 * random.normal(), 0.3 * random.normal()}};
      lenses.push_back(std::make_unique<MountedLens>(scene, optics::Assembly(scene.lens, offsets)));
    }
    pixels.resize(image_count, std::vector<float>(scene.sensor.pixels()));
    poses.resize(image_count, std::vector<double>(scene.axes()));
    for (std::size_t i = 0; i < image_count; ++i) {
      for (double& value : poses[i]) value = random.uniform(0.3, 0.7);
      items.push_back({lenses[i % lens_count].get(), &poses[i], i, pixels[i].data()});
    }
  }
  std::vector<std::unique_ptr<MountedLens>> lenses;
  std::vector<std::vector<double>> poses;
  std::vector<std::vector<float>> pixels;
  std::vector<BatchItem> items;
};

double seconds_of(const auto& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of GPU time, by events.
double seconds_on(gpu::Gpu& device, const auto& body) {
  device.start_clock();
  body();
  return device.stop_clock() / 1e3;
}

template <class Body>
double median_seconds(const Body& body, int rounds = 15) {
  std::vector<double> times;
  for (int i = 0; i < rounds; ++i) times.push_back(body());
  std::nth_element(times.begin(), times.begin() + rounds / 2, times.end());
  return times[static_cast<std::size_t>(rounds / 2)];
}

void compare_bits(gpu::GpuCamera& on_gpu, imaging::Camera& camera, const imaging::SceneFile& scene,
                  const imaging::Reference& reference) {
  Instances instances(scene, 16, 64);
  on_gpu.capture(instances.items);
  const std::vector<imaging::MseEstimate> mse = on_gpu.noise_free_mse(instances.items);
  std::vector<float> expected(scene.sensor.pixels());
  std::size_t equal = 0, equal_mse = 0, pixels = 0;
  double largest = 0, largest_mse = 0;
  for (std::size_t i = 0; i < instances.items.size(); ++i) {
    const BatchItem& item = instances.items[i];
    camera.capture(*item.lens, *item.true_pose, item.seed, expected.data());
    equal += instances.pixels[i] == expected ? 1 : 0;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      pixels += expected[k] == item.pixels[k] ? 0 : 1;
      largest = std::max(largest, static_cast<double>(std::fabs(expected[k] - item.pixels[k])));
    }
    const imaging::MseEstimate one = camera.noise_free_mse(*item.lens, *item.true_pose, item.seed, reference);
    equal_mse += one.mse == mse[i].mse && one.standard_error == mse[i].standard_error ? 1 : 0;
    largest_mse = std::max(largest_mse, std::fabs(one.mse - mse[i].mse) / one.standard_error);
  }
  std::printf("| captures with the CPU's bits | %zu of 64 (%zu pixels differ, by %.2g at most) |\n", equal, pixels,
              largest);
  std::printf("| MSE with the CPU's bits | %zu of 64 (by %.2g standard errors at most) |\n", equal_mse, largest_mse);
}

// Two samples of captures of one lens and pose, with other seeds: the means of all pixels, and the variance of an
// image.
struct Sample {
  explicit Sample(const std::vector<std::vector<float>>& images) : mean(images[0].size()), spread(images[0].size()) {
    const auto n = static_cast<double>(images.size());
    for (const std::vector<float>& image : images)
      for (std::size_t k = 0; k < image.size(); ++k) mean[k] += static_cast<double>(image[k]) / n;
    double squares = 0;
    for (const std::vector<float>& image : images) {
      double one = 0;
      for (std::size_t k = 0; k < image.size(); ++k) {
        const double off = static_cast<double>(image[k]) - mean[k];
        spread[k] += off * off / (n - 1);
        one += off * off * n / (n - 1);
      }
      variance += one / n;
      squares += one * one / n;
    }
    variance_error = std::sqrt((squares - variance * variance) / (n - 1));
  }
  std::vector<double> mean, spread;
  double variance = 0, variance_error = 0;  // summed over the pixels
};

bool compare_law(gpu::GpuCamera& on_gpu, imaging::Camera& camera, const imaging::SceneFile& scene) {
  constexpr std::size_t kImages = 512;
  Instances instances(scene, 1, kImages);
  for (BatchItem& item : instances.items) item.true_pose = &instances.poses[0];
  on_gpu.capture(instances.items);
  const Sample gpu_images(instances.pixels);
  for (std::size_t i = 0; i < kImages; ++i)
    camera.capture(*instances.lenses[0], instances.poses[0], kImages + i, instances.pixels[i].data());
  const Sample cpu_images(instances.pixels);
  double chi2 = 0, lit = 0, difference = 0;
  for (std::size_t k = 0; k < gpu_images.mean.size(); ++k) {
    const double off = gpu_images.mean[k] - cpu_images.mean[k], spread = gpu_images.spread[k] + cpu_images.spread[k];
    difference += off;
    if (!(spread > 0)) continue;
    chi2 += off * off * kImages / spread;
    lit += 1;
  }
  const double z_total = difference / std::sqrt((gpu_images.variance + cpu_images.variance) / kImages);
  const double z_pixels = (chi2 / lit - 1) / std::sqrt(2 / lit);
  const double z_variance =
      (gpu_images.variance - cpu_images.variance) / std::hypot(gpu_images.variance_error, cpu_images.variance_error);
  std::printf(
      "| 512 captures against the CPU's with other seeds: off by | total %.1f, pixels' means %.1f, variance %.1f "
      "standard errors |\n",
      z_total, z_pixels, z_variance);
  return std::fabs(z_total) < 5 && std::fabs(z_pixels) < 5 && std::fabs(z_variance) < 5;
}

void print_times(gpu::Gpu& device, gpu::GpuCamera& on_gpu, const imaging::SceneFile& scene) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{1024}}) {
    Instances instances(scene, std::min<std::size_t>(count, 64), count);
    on_gpu.capture(instances.items);  // fills tables, reserves memory
    const double prepare = median_seconds([&] { return seconds_of([&] { on_gpu.prepare(instances.items); }); });
    const double upload = median_seconds([&] { return seconds_of([&] { on_gpu.upload(); }); });
    const double tiles = median_seconds([&] { return seconds_on(device, [&] { on_gpu.fit_tiles(); }); });
    const double kernel = median_seconds([&] { return seconds_on(device, [&] { on_gpu.run(); }); });
    const double new_lenses = median_seconds([&] {
      const Instances fresh(scene, count, count);
      on_gpu.prepare(fresh.items);
      on_gpu.upload();
      return seconds_on(device, [&] { on_gpu.fit_tiles(); });
    });
    const double download = median_seconds([&] {
      return seconds_of([&] {
        for (std::size_t i = 0; i < count; ++i) on_gpu.download(i, instances.pixels[i].data());
      });
    });
    const double whole = median_seconds([&] { return seconds_of([&] { on_gpu.capture(instances.items); }); });
    const auto n = static_cast<double>(count);
    std::printf("| batch of %zu: kernels that render (events) | %.3f ms, %.0f images per second |\n", count,
                1e3 * kernel, n / kernel);
    std::printf("| batch of %zu: kernels that fit tiles (events), of known lenses, of new ones | %.3f, %.3f ms |\n",
                count, 1e3 * tiles, 1e3 * new_lenses);
    std::printf("| batch of %zu: paths on %u CPU threads, upload, download | %.3f, %.3f, %.3f ms |\n", count,
                core_count(), 1e3 * prepare, 1e3 * upload, 1e3 * download);
    std::printf("| batch of %zu: all of it | %.3f ms, %.0f images per second |\n", count, 1e3 * whole, n / whole);
  }
  Instances instances(scene, 64, 256);
  on_gpu.noise_free_mse(instances.items);
  const double mse = median_seconds([&] { return seconds_of([&] { on_gpu.noise_free_mse(instances.items); }); });
  std::printf("| noise-free MSE, batch of 256, all of it | %.3f ms, %.0f per second |\n", 1e3 * mse, 256 / mse);
}

void print_errors(gpu::Gpu& device, imaging::Camera& camera, const imaging::SceneFile& scene, Parallel& parallel,
                  const char* file) {
  constexpr double kWhite = 0.2;
  imaging::CaptureErrors errors(imaging::read_imaging_errors(file), scene.sensor, kWhite, scene.emitter.side_mm);
  gpu::GpuCamera on_gpu(device, scene, {}, parallel, &errors.drawn());
  Instances instances(scene, 64, 1024);
  on_gpu.capture(instances.items);
  std::vector<float> expected(scene.sensor.pixels());
  int equal = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    const BatchItem& item = instances.items[i];
    const bool altered = errors.draw(item.seed);
    camera.capture(*item.lens, *item.true_pose, item.seed, expected.data(),
                   altered ? errors.into_print() : std::nullopt);
    if (altered) errors.apply(expected.data());
    equal += instances.pixels[i] == expected ? 1 : 0;
  }
  std::printf("| captures with imaging errors with the CPU's bits | %d of 64 |\n", equal);
  const double kernels = median_seconds([&] { return seconds_on(device, [&] { on_gpu.run(); }); });
  const double prepare = median_seconds([&] { return seconds_of([&] { on_gpu.prepare(instances.items); }); });
  std::printf("| batch of 1024 with imaging errors: kernels (events); paths and errors on the CPU | %.3f, %.3f ms |\n",
              1e3 * kernels, 1e3 * prepare);
}

// The same with reflections, whose images have the CPU's distribution only (gpu/ghost_kernel.h).
bool print_reflections(gpu::Gpu& device, const imaging::SceneFile& scene, Parallel& parallel) {
  imaging::CaptureSettings settings;
  settings.transport = imaging::Transport::ghost;
  settings.sensor_albedo = 0.5;
  std::optional<gpu::GpuCamera> on_gpu;
  try {
    on_gpu.emplace(device, scene, settings, parallel);
  } catch (const Error& error) {
    std::printf("| reflections: %s | |\n", error.what());
    return true;
  }
  std::printf("| with reflections (transport ghost): | |\n");
  imaging::Camera camera(scene, settings, parallel);
  const bool same_law = compare_law(*on_gpu, camera, scene);
  for (const std::size_t count : {std::size_t{1}, std::size_t{256}}) {
    Instances instances(scene, std::min<std::size_t>(count, 64), count);
    on_gpu->capture(instances.items);
    const double prepare = median_seconds([&] { return seconds_of([&] { on_gpu->prepare(instances.items); }); });
    on_gpu->upload();
    const double kernel = median_seconds([&] { return seconds_on(device, [&] { on_gpu->run(); }); });
    const double whole = median_seconds([&] { return seconds_of([&] { on_gpu->capture(instances.items); }); });
    std::printf(
        "| batch of %zu: kernel (events), paths on %u CPU threads, all of it | %.3f, %.3f, %.3f ms, %.0f images "
        "per second |\n",
        count, core_count(), 1e3 * kernel, 1e3 * prepare, 1e3 * whole, static_cast<double>(count) / whole);
  }
  return same_law;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: relign-bench-gpu SCENE_FILE [ERRORS_FILE]\n");
    return 2;
  }
  try {
    gpu::Gpu device;
    const imaging::SceneFile scene = imaging::read_scene_file(argv[1], {});
    Parallel parallel(core_count());
    gpu::GpuCamera on_gpu(device, scene, {}, parallel);
    imaging::Camera camera(scene, {}, parallel);
    const imaging::Reference reference = imaging::make_reference(scene, {}, parallel, {}, {});
    on_gpu.set_reference(reference);
    std::printf("| %s, scene %s, %d x %d | |\n|---|---|\n", device.name().c_str(), scene.name.c_str(),
                scene.sensor.width, scene.sensor.height);
    compare_bits(on_gpu, camera, scene, reference);
    bool same_law = compare_law(on_gpu, camera, scene);
    print_times(device, on_gpu, scene);
    if (argc == 3) print_errors(device, camera, scene, parallel, argv[2]);
    same_law = print_reflections(device, scene, parallel) && same_law;
    return same_law ? 0 : 1;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
