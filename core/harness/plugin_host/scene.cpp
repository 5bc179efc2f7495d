#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"
#include "plugin_host/scene_backend.h"

namespace relign::plugin_host {

struct Scene::Implementation {
  std::unique_ptr<SceneBackend> backend;

  SceneBackend& own_stage(const char* what) const {
    if (!backend->offers_stage()) backend->refuse(what, std::string("it does not offer ") + RELIGN_SCENE_STAGE);
    return *backend;
  }
  SceneBackend::Batch backend_of(const Batch& batch) const;
};

struct MountedAssembly::Implementation {
  std::shared_ptr<Scene::Implementation> scene;  // outlives `backend`
  std::unique_ptr<AssemblyBackend> backend;
};

SceneBackend::Batch Scene::Implementation::backend_of(const Batch& batch) const {
  SceneBackend::Batch of{{}, batch.true_poses, batch.seeds};
  for (MountedAssembly* assembly : batch.assemblies) of.assemblies.push_back(assembly->implementation_->backend.get());
  return of;
}

namespace {

void check_truth(SceneBackend& scene, const char* what, const MountedAssembly::Truth& truth) {
  if (!std::isfinite(truth.mse) || !std::isfinite(truth.standard_error) || truth.standard_error < 0)
    scene.refuse(what, "value or standard error is not finite, or the standard error is negative");
}

}  // namespace

Scene::Scene(const Choice& choice, const HostServices& services) : implementation_(std::make_shared<Implementation>()) {
  const bool is_process = !choice.plugin->command.empty();
  implementation_->backend = is_process ? make_process_scene(choice, services) : make_library_scene(choice, services);
}

Scene::~Scene() = default;

std::string Scene::describe() { return implementation_->backend->describe(); }

relign_image Scene::reference() {
  const relign_image image = implementation_->backend->reference();
  if (!RELIGN_HAS_MEMBER(&image, row_stride_bytes) || image.sample_format != RELIGN_SAMPLE_FLOAT32 ||
      image.channels != 1 || image.width == 0 || image.height == 0 || !image.pixels ||
      image.row_stride_bytes < std::uint64_t{image.width} * sizeof(float))
    implementation_->backend->refuse("reference", "the image is not a complete float32 image of one channel");
  return image;
}

MountedAssembly Scene::mount(const std::string& offsets_json) {
  auto assembly = std::make_unique<MountedAssembly::Implementation>();
  assembly->scene = implementation_;
  assembly->backend = implementation_->backend->mount(offsets_json);
  return MountedAssembly(std::move(assembly));
}

std::string Scene::open_gpu() { return implementation_->backend->open_gpu(); }

std::vector<double> Scene::capture_batch(const Batch& batch, const std::vector<std::uint32_t>& places, float* images) {
  SceneBackend& scene = *implementation_->backend;
  std::vector<double> rmse = scene.capture_batch(implementation_->backend_of(batch), places, images);
  if (!std::all_of(rmse.begin(), rmse.end(), [](double value) { return std::isfinite(value) && value >= 0; }))
    scene.refuse("capture_batch", "an RMSE is negative or not finite");
  return rmse;
}

std::vector<MountedAssembly::Truth> Scene::mse_batch(const Batch& batch) {
  std::vector<MountedAssembly::Truth> truths = implementation_->backend->mse_batch(implementation_->backend_of(batch));
  for (const MountedAssembly::Truth& truth : truths) check_truth(*implementation_->backend, "mse_batch", truth);
  return truths;
}

bool Scene::offers_stage() const { return implementation_->backend->offers_stage(); }

void Scene::begin(std::uint64_t seed) { implementation_->own_stage("begin").begin(seed); }

namespace {

// Messages on invalid values in a station's answer; empty if there are none.
std::string flaw_of_seconds(double machine_seconds) {
  if (std::isfinite(machine_seconds) && machine_seconds >= 0) return "";
  return "machine_seconds is " + shortest(machine_seconds) + "; expected a finite number of at least 0";
}

std::string flaw_of(const Scene::StageMove& answer, std::size_t axes) {
  const std::uint64_t known_axes = axes >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << axes) - 1;
  if ((answer.limits_low | answer.limits_high) & ~known_axes)
    return "limit flags exceed its " + std::to_string(axes) + " axes; expected bit i for axis i";
  for (std::size_t axis = 0; axis < axes; ++axis)
    if (!std::isfinite(answer.moved[axis]))
      return "the reported move of axis " + std::to_string(axis) + " is " + shortest(answer.moved[axis]) +
             "; expected a fraction of the travel";
  return flaw_of_seconds(answer.machine_seconds);
}

}  // namespace

Scene::StageMove Scene::move_by(const std::vector<double>& delta) {
  SceneBackend& stage = implementation_->own_stage("move_by");
  StageMove made = stage.move_by(delta);
  if (const std::string flaw = flaw_of(made, delta.size()); !flaw.empty()) stage.refuse("move_by", flaw);
  return made;
}

double Scene::capture(float* pixels) {
  SceneBackend& stage = implementation_->own_stage("capture");
  const double machine_seconds = stage.capture(pixels);
  if (const std::string flaw = flaw_of_seconds(machine_seconds); !flaw.empty()) stage.refuse("capture", flaw);
  return machine_seconds;
}

MountedAssembly::MountedAssembly(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MountedAssembly::MountedAssembly(MountedAssembly&&) noexcept = default;
MountedAssembly::~MountedAssembly() = default;

void MountedAssembly::capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels) {
  implementation_->backend->capture(true_pose, frame_seed, pixels);
}

bool MountedAssembly::captures_regions() const { return implementation_->scene->backend->offers("capture_regions"); }

MountedAssembly::Truth MountedAssembly::noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed) {
  const Truth truth = implementation_->backend->noise_free_mse(true_pose, seed);
  SceneBackend& scene = *implementation_->scene->backend;
  check_truth(scene, scene.judge(), truth);
  return truth;
}

namespace {

// Refuses an ability's result that its description excludes.
struct Checks {
  SceneBackend& scene;
  const char* what;

  void expect(bool fits, const char* name, double value, const char* expected) const {
    if (!fits) refuse("'" + std::string(name) + "' is " + shortest(value) + "; expected " + expected);
  }
  void finite(const char* name, double value) const { expect(std::isfinite(value), name, value, "a finite number"); }
  void error(const char* name, double value) const {
    expect(std::isfinite(value) && value >= 0, name, value, "a finite number of at least 0");
  }
  void fraction(const char* name, double value) const { expect(value >= 0 && value <= 1, name, value, "0 to 1"); }
  void pose(const char* name, const Pose& values) const {
    for (const double value : values) expect(value >= 0 && value <= 1, name, value, "0 to 1 on every axis");
  }
  void refuse(const std::string& message) const { scene.refuse(what, message); }
};

}  // namespace

#include "checked_abilities.inc"

}  // namespace relign::plugin_host
