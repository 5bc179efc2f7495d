// Electronics and imaging errors on the emulated driver against those of the CPU, bit for bit.
#include "gpu/read_out_steps.h"

#include <gmock/gmock.h>

#include <memory>

#include "gpu/emulated_driver.h"
#include "gpu/gpu_camera.h"
#include "images/score.h"
#include "imaging/capture_errors.h"
#include "imaging/scene_under_test.h"

namespace relign::gpu::read_out {
namespace {

using imaging::SceneFile;
using Images = std::vector<std::vector<float>>;

constexpr double kWhite = 0.2;
constexpr std::size_t kCount = 4;

// One for each step of capture_errors.h, and stray light without some of its parts.
constexpr const char* kEach[] = {
    R"("target": {"scale": [0.9, 1.1], "shift": 0.02, "rotation_deg": [-20, 20]})",
    R"("vignetting": [0.1, 0.9])",
    R"("stray_light": {"mean": [0.01, 0.2]})",
    R"("stray_light": {"mean": 0.1, "blobs": [1, 3], "gradient": [0, 1]})",
    R"("stray_light": {"mean": 0.1, "gradient": 2, "rings": [1, 2], "arcs": [1, 3], "ring_share": [0.1, 0.5]})",
    R"("blur_px": [0.1, 1])",
    R"("blur_px": 20)",
    R"("photon": [0.01, 1])",
    R"("photon": [0.0001, 0.05])",
    R"("pixel_gain": [0, 0.1])",
    R"("gain": [0.5, 2])",
    R"("gamma": [0.5, 2])",
    R"("pixel_offset": [0, 0.1])",
    R"("offset": [-0.1, 0.1])",
    R"("read_noise": [0, 0.1])",
    R"("hot_pixels": [0, 0.1], "full_scale": [3, 4])",
    R"("bits": [2, 14], "full_scale": [0.5, 4])"};

const char kAll[] =
    R"("target": {"scale": [0.99, 1.01], "shift": [-0.002, 0.002], "rotation_deg": [-0.2, 0.2]},
    "vignetting": [0, 0.2], "stray_light": {"mean": [0, 0.05], "blobs": [0, 3], "gradient": [0, 0.5], "rings": [0, 2],
    "arcs": [0, 1], "ring_share": [0, 0.3]}, "blur_px": [0, 0.8], "photon": [0, 0.25], "pixel_gain": [0, 0.02],
    "gain": [0.88, 1.12], "gamma": [0.92, 1.08], "pixel_offset": [0, 0.005], "offset": [0, 0.03],
    "read_noise": [0, 0.03], "hot_pixels": [0, 0.01], "full_scale": [3, 4], "bits": [8, 14], "share": 0.8,
    "error_share": 0.8)";

SceneFile scene_of(const std::string& file, int pixels) {
  imaging::SceneChoices choices;
  choices.pixels = pixels;
  return imaging::read_scene_file(file, choices);
}

// Square, and wider than high.
const std::vector<SceneFile>& scenes() {
  static const std::vector<SceneFile> two = [] {
    SceneFile wide = scene_of(imaging::relign_od_file(), 40);
    wide.sensor.height = 27;
    wide.pupil = nullptr;
    return std::vector<SceneFile>{scene_of(imaging::scene_folder() + "cooke_triplet/scene.json", 32), wide};
  }();
  return two;
}

struct Instances {
  explicit Instances(const SceneFile& scene) {
    Random random(7);
    for (std::size_t i = 0; i < kCount; ++i) {
      lenses.push_back(std::make_unique<imaging::MountedLens>(scene));
      poses.emplace_back(scene.axes());
      for (double& value : poses.back()) value = random.uniform(0.4, 0.6);
    }
    images.assign(kCount, std::vector<float>(scene.sensor.pixels()));
    for (std::size_t i = 0; i < kCount; ++i) items.push_back({lenses[i].get(), &poses[i], 90 + i, images[i].data()});
  }
  std::vector<std::unique_ptr<imaging::MountedLens>> lenses;
  std::vector<std::vector<double>> poses;
  Images images;
  std::vector<imaging::BatchItem> items;
};

// On the CPU, one after the other.
Images captures(const SceneFile& scene, Instances& instances, imaging::CaptureErrors* errors) {
  Parallel alone(1);
  imaging::Camera camera(scene, {}, alone);
  Images images(kCount, std::vector<float>(scene.sensor.pixels()));
  for (std::size_t i = 0; i < kCount; ++i) {
    const bool altered = errors && errors->draw(instances.items[i].seed);
    camera.capture(*instances.lenses[i], instances.poses[i], instances.items[i].seed, images[i].data(),
                   altered ? errors->into_print() : std::nullopt);
    if (altered) errors->apply(images[i].data());
  }
  return images;
}

imaging::CaptureErrors errors_of(const SceneFile& scene, const std::string& drawn, const std::string& errors) {
  const std::string json = R"({"seed": 3, "drawn": ")" + drawn + "\", " + errors + "}";
  return {imaging::read_imaging_errors(JsonSource::from_text(json, "errors.json")), scene.sensor, kWhite,
          scene.emitter.side_mm};
}

void expect_bits_of_cpu(Gpu& gpu, const SceneFile& scene, const std::string& drawn, const std::string& json) {
  SCOPED_TRACE(scene.name + ", drawn by " + drawn + ": " + json);
  Parallel two(2);
  Instances instances(scene);
  imaging::CaptureErrors errors = errors_of(scene, drawn, json);
  GpuCamera camera(gpu, scene, {}, two, &errors.drawn());
  camera.capture(instances.items);
  const Images expected = captures(scene, instances, &errors), ideal = captures(scene, instances, nullptr);
  EXPECT_EQ(instances.images, expected);
  EXPECT_NE(expected, ideal);
}

TEST(GpuReadOut, HasTheBitsOfTheCpuForEachError) {
  const EmulatedGpu emulated;
  Gpu gpu;
  for (const SceneFile& scene : scenes())
    for (const char* drawn : {"scene", "capture"})
      for (const char* json : kEach) expect_bits_of_cpu(gpu, scene, drawn, json);
}

TEST(GpuReadOut, HasTheBitsOfTheCpuForAllErrorsTogether) {
  const EmulatedGpu emulated;
  Gpu gpu;
  for (const SceneFile& scene : scenes())
    for (const char* drawn : {"scene", "capture"}) expect_bits_of_cpu(gpu, scene, drawn, kAll);
}

TEST(GpuReadOut, HasTheBitsOfTheCpuForElectronicsBeforeErrors) {
  const EmulatedGpu emulated;
  Gpu gpu;
  SceneFile scene = scenes().front();
  for (const int bits : {0, 6}) {
    scene.sensor.electronics = imaging::Electronics{0.5, 300, 4, bits};
    Instances instances(scene);
    Parallel alone(1);
    GpuCamera(gpu, scene, {}, alone).capture(instances.items);
    EXPECT_EQ(instances.images, captures(scene, instances, nullptr));
    EXPECT_NE(instances.images, captures(scenes().front(), instances, nullptr));
    expect_bits_of_cpu(gpu, scene, "capture", kAll);
  }
}

TEST(GpuReadOut, MeasuresRmseAfterTheErrorsAndMseWithout) {
  const EmulatedGpu emulated;
  Gpu gpu;
  const SceneFile& scene = scenes().back();
  Parallel alone(1);
  Instances instances(scene);
  imaging::CaptureErrors errors = errors_of(scene, "capture", kAll);
  const Images expected = captures(scene, instances, &errors);
  const imaging::Reference reference{expected[1], expected[2], expected[3]};
  GpuCamera camera(gpu, scene, {}, alone, &errors.drawn()), ideal(gpu, scene, {}, alone);
  for (GpuCamera* one : {&camera, &ideal}) one->set_reference(reference);
  const std::size_t pixels = scene.sensor.pixels(), bytes = pixels * sizeof(float);
  Buffer memory(gpu);
  memory.reserve(6 * bytes);
  const std::vector<std::uint32_t> places = {5, 0, 2, 1};
  const std::vector<double> rmse = camera.capture(instances.items, places, memory.as<float>());
  std::vector<float> found(pixels);
  for (std::size_t i = 0; i < kCount; ++i) {
    memory.download(found.data(), bytes, places[i] * bytes);
    EXPECT_EQ(found, expected[i]) << i;
    EXPECT_EQ(rmse[i], images::rmse(found.data(), reference.mean.data(), pixels)) << i;
  }
  const auto with = camera.noise_free_mse(instances.items), without = ideal.noise_free_mse(instances.items);
  for (std::size_t i = 0; i < kCount; ++i) EXPECT_EQ(with[i].mse, without[i].mse) << i;
}

}  // namespace
}  // namespace relign::gpu::read_out
