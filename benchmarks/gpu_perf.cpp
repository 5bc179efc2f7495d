// relign-bench-gpu PART... --scene FILE: a GPU against the CPU, and its times, as rows of docs/performance.md
// (docs/gpu.md). Needs a GPU: benchmarks/gpu_all.sh runs it, or you by hand. Exit status 1 if anything differs, in bits
// where the GPU has the CPU's, in distribution elsewhere.
#include "gpu_perf.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <relign/random.hpp>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/machine.h"
#include "gpu/gpu_camera.h"
#include "imaging/capture_errors.h"
#include "imaging/reference.h"

namespace relign::gpu_perf {
namespace {

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

// "64 of 64".
std::string share(std::size_t equal, std::size_t all) { return std::to_string(equal) + " of " + std::to_string(all); }

// Where all parts find the scene, on the GPU and on the CPU.
class Comparison {
 public:
  Comparison(const std::filesystem::path& file, const Sizes& sizes)
      : sizes_(sizes), scene_(read(file, sizes.pixels)), parallel_(core_count()) {
    std::printf("| %s, scene %s, %d x %d | |\n|---|---|\n", device_.name().c_str(), scene_.name.c_str(),
                scene_.sensor.width, scene_.sensor.height);
  }

  bool bits();
  bool law() { return same_law({}); }
  bool errors(const std::filesystem::path& file);
  bool ghosts() { return same_law(reflections()); }
  void times();
  void latency();
  void ghost_times();

 private:
  bool same_law(const imaging::CaptureSettings& settings);
  double median(const auto& body) const { return median_of(sizes_.rounds, body); }
  double time_of(const auto& body) const {
    return median([&] { return seconds_of(body); });
  }
  // Of the GPU alone, by events.
  double gpu_time_of(const auto& body) {
    return median([&] { return gpu_seconds_of(body); });
  }
  double gpu_seconds_of(const auto& body) {
    device_.start_clock();
    body();
    return device_.stop_clock() / 1e3;
  }

  static imaging::SceneFile read(const std::filesystem::path& file, int pixels) {
    imaging::SceneChoices choices;
    choices.pixels = pixels;
    return imaging::read_scene_file(file, choices);
  }
  static imaging::CaptureSettings reflections() {  // as in the paper's package
    imaging::CaptureSettings settings;
    settings.transport = imaging::Transport::ghost;
    settings.sensor_albedo = 0.5;
    return settings;
  }

  Sizes sizes_;
  gpu::Gpu device_;
  imaging::SceneFile scene_;
  Parallel parallel_;
};

bool Comparison::bits() {
  gpu::GpuCamera on_gpu(device_, scene_, {}, parallel_);
  imaging::Camera camera(scene_, {}, parallel_);
  const imaging::Reference reference = imaging::make_reference(scene_, {}, parallel_, {}, {});
  on_gpu.set_reference(reference);
  Instances instances(scene_, std::min<std::size_t>(sizes_.images, 16), sizes_.images);
  on_gpu.capture(instances.items);
  const std::vector<imaging::MseEstimate> mse = on_gpu.noise_free_mse(instances.items);
  std::vector<float> expected(scene_.sensor.pixels());
  std::size_t equal = 0, equal_mse = 0, pixels = 0;
  double largest = 0, largest_mse = 0;
  for (std::size_t i = 0; i < sizes_.images; ++i) {
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
  std::printf("| captures with the CPU's bits | %s (%zu pixels differ, by %.2g at most) |\n",
              share(equal, sizes_.images).c_str(), pixels, largest);
  std::printf("| MSE with the CPU's bits | %s (by %.2g standard errors at most) |\n",
              share(equal_mse, sizes_.images).c_str(), largest_mse);
  return equal == sizes_.images && equal_mse == sizes_.images;
}

bool Comparison::same_law(const imaging::CaptureSettings& settings) {
  gpu::GpuCamera on_gpu(device_, scene_, settings, parallel_);
  imaging::Camera camera(scene_, settings, parallel_);
  Instances instances(scene_, 1, sizes_.captures);
  for (BatchItem& item : instances.items) item.true_pose = &instances.poses[0];
  on_gpu.capture(instances.items);
  const Sample gpu_images(instances.pixels);
  for (std::size_t i = 0; i < sizes_.captures; ++i)
    camera.capture(*instances.lenses[0], instances.poses[0], sizes_.captures + i, instances.pixels[i].data());
  const Sample cpu_images(instances.pixels);
  const auto count = static_cast<double>(sizes_.captures);
  double chi2 = 0, lit = 0, difference = 0;
  for (std::size_t k = 0; k < gpu_images.mean.size(); ++k) {
    const double off = gpu_images.mean[k] - cpu_images.mean[k], spread = gpu_images.spread[k] + cpu_images.spread[k];
    difference += off;
    if (!(spread > 0)) continue;
    chi2 += off * off * count / spread;
    lit += 1;
  }
  if (lit == 0 || !(gpu_images.variance_error > 0))
    throw Error(ErrorKind::bad_input, "no pixel of these captures is lit and noisy, so that nothing can be compared");
  const double z_total = difference / std::sqrt((gpu_images.variance + cpu_images.variance) / count);
  const double z_pixels = (chi2 / lit - 1) / std::sqrt(2 / lit);
  const double z_variance =
      (gpu_images.variance - cpu_images.variance) / std::hypot(gpu_images.variance_error, cpu_images.variance_error);
  std::printf(
      "| %zu captures%s against the CPU's with other seeds: off by | total %.1f, pixels' means %.1f, variance %.1f "
      "standard errors |\n",
      sizes_.captures, settings.transport == imaging::Transport::ghost ? " with reflections" : "", z_total, z_pixels,
      z_variance);
  return std::fabs(z_total) < 5 && std::fabs(z_pixels) < 5 && std::fabs(z_variance) < 5;
}

bool Comparison::errors(const std::filesystem::path& file) {
  constexpr double kWhite = 0.2;
  imaging::CaptureErrors errors(imaging::read_imaging_errors(file), scene_.sensor, kWhite, scene_.emitter.side_mm);
  gpu::GpuCamera on_gpu(device_, scene_, {}, parallel_, &errors.drawn());
  imaging::Camera camera(scene_, {}, parallel_);
  Instances instances(scene_, std::min<std::size_t>(sizes_.batch, 64), sizes_.batch);
  on_gpu.capture(instances.items);
  std::vector<float> expected(scene_.sensor.pixels());
  const std::size_t compared = std::min(sizes_.images, sizes_.batch);
  std::size_t equal = 0;
  for (std::size_t i = 0; i < compared; ++i) {
    const BatchItem& item = instances.items[i];
    const bool altered = errors.draw(item.seed);
    camera.capture(*item.lens, *item.true_pose, item.seed, expected.data(),
                   altered ? errors.into_print() : std::nullopt);
    if (altered) errors.apply(expected.data());
    equal += instances.pixels[i] == expected ? 1 : 0;
  }
  std::printf("| captures with imaging errors with the CPU's bits | %s |\n", share(equal, compared).c_str());
  const double kernels = gpu_time_of([&] { on_gpu.run(); });
  const double prepare = time_of([&] { on_gpu.prepare(instances.items); });
  std::printf("| batch of %zu with imaging errors: kernels (events); paths and errors on the CPU | %.3f, %.3f ms |\n",
              sizes_.batch, 1e3 * kernels, 1e3 * prepare);
  return equal == compared;
}

void Comparison::times() {
  gpu::GpuCamera on_gpu(device_, scene_, {}, parallel_);
  on_gpu.set_reference(imaging::make_reference(scene_, {}, parallel_, {}, {}));
  const std::size_t count = sizes_.batch, lenses = std::min<std::size_t>(count, 64);
  {
    Instances instances(scene_, lenses, count);
    on_gpu.capture(instances.items);  // fills tables, reserves memory
    const double prepare = time_of([&] { on_gpu.prepare(instances.items); });
    const double upload = time_of([&] { on_gpu.upload(); });
    const double tiles = gpu_time_of([&] { on_gpu.fit_tiles(); });
    const double kernel = gpu_time_of([&] { on_gpu.run(); });
    const double new_lenses = median([&] {
      const Instances fresh(scene_, count, count);
      on_gpu.prepare(fresh.items);
      on_gpu.upload();
      return gpu_seconds_of([&] { on_gpu.fit_tiles(); });
    });
    const double download = time_of([&] {
      for (std::size_t i = 0; i < count; ++i) on_gpu.download(i, instances.pixels[i].data());
    });
    const double whole = time_of([&] { on_gpu.capture(instances.items); });
    const auto n = static_cast<double>(count);
    std::printf("| batch of %zu: kernels that render (events) | %.3f ms, %.0f images per second |\n", count,
                1e3 * kernel, n / kernel);
    std::printf("| batch of %zu: kernels that fit tiles (events), of known lenses, of new ones | %.3f, %.3f ms |\n",
                count, 1e3 * tiles, 1e3 * new_lenses);
    std::printf("| batch of %zu: paths on %u CPU threads, upload, download | %.3f, %.3f, %.3f ms |\n", count,
                core_count(), 1e3 * prepare, 1e3 * upload, 1e3 * download);
    std::printf("| batch of %zu: all of it | %.3f ms, %.0f images per second |\n", count, 1e3 * whole, n / whole);
  }
  const std::size_t few = std::max<std::size_t>(1, count / 4);
  Instances instances(scene_, std::min(few, lenses), few);
  on_gpu.noise_free_mse(instances.items);
  const double mse = time_of([&] { on_gpu.noise_free_mse(instances.items); });
  std::printf("| noise-free MSE, batch of %zu, all of it | %.3f ms, %.0f per second |\n", few, 1e3 * mse,
              static_cast<double>(few) / mse);
}

void Comparison::latency() {
  gpu::GpuCamera on_gpu(device_, scene_, {}, parallel_);
  on_gpu.set_reference(imaging::make_reference(scene_, {}, parallel_, {}, {}));
  Instances instances(scene_, 1, 1);
  gpu::Buffer image(device_);
  image.reserve(scene_.sensor.pixels() * sizeof(float));
  on_gpu.capture(instances.items);
  const double kernel = gpu_time_of([&] { on_gpu.run(); }), tiles = gpu_time_of([&] { on_gpu.fit_tiles(); });
  const double left_there = time_of([&] { on_gpu.capture(instances.items, {0}, image.as<float>()); });
  const double copied = time_of([&] { on_gpu.capture(instances.items); });
  std::printf("| one image: kernels that render, that fit tiles (events) | %.3f, %.3f ms |\n", 1e3 * kernel,
              1e3 * tiles);
  std::printf("| one image and its RMSE, left on the GPU | %.3f ms |\n", 1e3 * left_there);
  std::printf("| one image, copied to the host | %.3f ms |\n", 1e3 * copied);
}

void Comparison::ghost_times() {
  gpu::GpuCamera on_gpu(device_, scene_, reflections(), parallel_);
  for (const std::size_t count : {std::size_t{1}, sizes_.batch}) {
    Instances instances(scene_, std::min<std::size_t>(count, 64), count);
    on_gpu.capture(instances.items);
    const double prepare = time_of([&] { on_gpu.prepare(instances.items); });
    on_gpu.upload();
    const double kernel = gpu_time_of([&] { on_gpu.run(); });
    const double whole = time_of([&] { on_gpu.capture(instances.items); });
    std::printf("| batch of %zu with reflections: kernel (events), paths on %u CPU threads | %.3f, %.3f ms |\n", count,
                core_count(), 1e3 * kernel, 1e3 * prepare);
    std::printf("| batch of %zu with reflections: all of it | %.3f ms, %.0f images per second |\n", count, 1e3 * whole,
                static_cast<double>(count) / whole);
  }
}

int run(int argc, char** argv) {
  CLI::App app("Compare a GPU's images with the CPU's, and time them.");
  const std::vector<std::string> known = {"bits",    "law",   "errors",      "ghosts",
                                          "latency", "times", "ghost-times", "environment"};
  std::vector<std::string> parts;
  std::filesystem::path scene, errors, plugins;
  Sizes sizes;
  app.add_option("PART", parts, "What to run, in this order")->required()->check(CLI::IsMember(known));
  app.add_option("--scene", scene, "Scene file, for all parts but environment");
  app.add_option("--errors", errors, "File of imaging errors, for errors");
  app.add_option("--plugins", plugins, "Folder of plugins, for environment");
  app.add_option("--images", sizes.images, "Images that are compared")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--captures", sizes.captures, "Captures of each sample of a distribution")
      ->check(CLI::Range(8, 4096))
      ->capture_default_str();
  app.add_option("--batch", sizes.batch, "Images of a batch that is timed, instances of the environment")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  app.add_option("--rounds", sizes.rounds, "Calls whose median is a time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--pixels", sizes.pixels, "Columns of the images; 0: the scene's")->check(CLI::Range(0, 8192));
  CLI11_PARSE(app, argc, argv);
  std::optional<Comparison> comparison;
  bool same = true;
  for (const std::string& part : parts) {
    if (part == "environment") {
      print_environment(plugins, sizes);
      continue;
    }
    if (!comparison) comparison.emplace(scene, sizes);
    if (part == "bits") same = comparison->bits() && same;
    if (part == "law") same = comparison->law() && same;
    if (part == "errors") same = comparison->errors(errors) && same;
    if (part == "ghosts") same = comparison->ghosts() && same;
    if (part == "latency") comparison->latency();
    if (part == "times") comparison->times();
    if (part == "ghost-times") comparison->ghost_times();
    std::fflush(stdout);
  }
  return same ? 0 : 1;
}

}  // namespace
}  // namespace relign::gpu_perf

int main(int argc, char** argv) {
  try {
    return relign::gpu_perf::run(argc, argv);
  } catch (const relign::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
