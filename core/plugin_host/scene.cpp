#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "base/text.h"
#include "plugin_host/guard.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {

struct Scene::Implementation {
  Implementation(const Choice& choice, const HostServices& services)
      : manifest(choice.plugin), host(*choice.plugin, services) {}
  ~Implementation() {
    if (!object) return;
    const FloatingPointGuard guard(host.plugin_id());
    try {
      table->destroy(object);
    } catch (...) {  // a destructor has nobody to tell
    }
  }

  std::shared_ptr<const Manifest> manifest;
  ObjectHost host;
  const relign_scene_interface* table = nullptr;
  const relign_scene_noise_free* noise_free = nullptr;  // null when not offered
  const relign_scene_stage* stage = nullptr;            // null when not offered
  relign_scene* object = nullptr;

  const relign_scene_stage& own_stage(const char* what) const {
    if (!stage) host.throw_failure(what, std::string("it does not offer ") + RELIGN_SCENE_STAGE);
    return *stage;
  }
};

struct MountedAssembly::Implementation {
  ~Implementation() {
    if (!object) return;
    const FloatingPointGuard guard(scene->host.plugin_id());
    try {
      scene->table->unmount(object);
    } catch (...) {  // a destructor has nobody to tell
    }
  }

  std::shared_ptr<Scene::Implementation> scene;
  relign_assembly* object = nullptr;
};

Scene::Scene(const Choice& choice, const HostServices& services)
    : implementation_(std::make_shared<Implementation>(choice, services)) {
  Implementation& mine = *implementation_;
  const Manifest& manifest = *mine.manifest;
  const auto* table = static_cast<const relign_scene_interface*>(
      plugin_interface(manifest, RELIGN_SCENE_INTERFACE,
                       offsetof(relign_scene_interface, destroy) + sizeof(relign_scene_interface::destroy)));
  require_function(manifest, RELIGN_SCENE_INTERFACE, "create", table->create);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "describe", table->describe);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "reference", table->reference);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "mount", table->mount);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "unmount", table->unmount);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "capture", table->capture);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "noise_free_mse", table->noise_free_mse);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "destroy", table->destroy);
  mine.table = table;
  const ParameterTable parameters(choice);
  const relign_status status = mine.host.call("create", [&](const FloatingPointState&) {
    return table->create(mine.host.host(), parameters.table(), &mine.object);
  });
  if (status != RELIGN_OK || !mine.object) mine.host.throw_failure("create", "it made no object and gives no reason");
  if (!RELIGN_HAS_MEMBER(table, get_extension) || !table->get_extension) return;
  mine.host.call("get_extension", [&](const FloatingPointState&) -> relign_status {
    mine.noise_free = static_cast<const relign_scene_noise_free*>(
        table->get_extension(mine.object, {RELIGN_SCENE_NOISE_FREE, std::strlen(RELIGN_SCENE_NOISE_FREE)}));
    mine.stage = static_cast<const relign_scene_stage*>(
        table->get_extension(mine.object, {RELIGN_SCENE_STAGE, std::strlen(RELIGN_SCENE_STAGE)}));
    return RELIGN_OK;
  });
  if (mine.noise_free && (!RELIGN_HAS_MEMBER(mine.noise_free, render) || !mine.noise_free->render))
    mine.noise_free = nullptr;
  if (!mine.stage) return;
  const bool complete =
      RELIGN_HAS_MEMBER(mine.stage, capture) && mine.stage->begin && mine.stage->move_by && mine.stage->capture;
  if (!complete)
    mine.host.throw_failure("get_extension", std::string(RELIGN_SCENE_STAGE) + " lacks begin, move_by or capture");
}

Scene::~Scene() = default;

std::string Scene::describe() {
  Implementation& mine = *implementation_;
  const TextSink description;
  const relign_status status = mine.host.call(
      "describe", [&](const FloatingPointState&) { return mine.table->describe(mine.object, description.sink()); });
  if (status != RELIGN_OK) mine.host.throw_failure("describe", "it wrote nothing and gives no reason");
  return description.text();
}

relign_image Scene::reference() {
  Implementation& mine = *implementation_;
  relign_image image{};
  image.struct_size = sizeof image;
  const relign_status status = mine.host.call(
      "reference", [&](const FloatingPointState&) { return mine.table->reference(mine.object, &image); });
  if (status != RELIGN_OK) mine.host.throw_failure("reference", "it gave no image and no reason");
  if (!RELIGN_HAS_MEMBER(&image, row_stride_bytes) || image.sample_format != RELIGN_SAMPLE_FLOAT32 ||
      image.channels != 1 || image.width == 0 || image.height == 0 || !image.pixels ||
      image.row_stride_bytes < std::uint64_t{image.width} * sizeof(float))
    mine.host.throw_failure("reference", "the image is no complete float32 image of one channel");
  return image;
}

MountedAssembly Scene::mount(const std::string& offsets_json) {
  Implementation& mine = *implementation_;
  auto assembly = std::make_unique<MountedAssembly::Implementation>();
  assembly->scene = implementation_;
  const relign_status status = mine.host.call("mount", [&](const FloatingPointState&) {
    return mine.table->mount(mine.object, {offsets_json.data(), offsets_json.size()}, &assembly->object);
  });
  if (status != RELIGN_OK || !assembly->object)
    mine.host.throw_failure("mount", "it mounted nothing and gives no reason");
  return MountedAssembly(std::move(assembly));
}

bool Scene::offers_stage() const { return implementation_->stage != nullptr; }

void Scene::begin(std::uint64_t seed) {
  Implementation& mine = *implementation_;
  const relign_scene_stage& stage = mine.own_stage("begin");
  const relign_status status =
      mine.host.call("begin", [&](const FloatingPointState&) { return stage.begin(mine.object, seed); });
  if (status != RELIGN_OK) mine.host.throw_failure("begin", "it went to no start pose and gives no reason");
}

namespace {

// What cannot be in a station's answer, or an empty text.
std::string flaw_of_seconds(double machine_seconds) {
  if (std::isfinite(machine_seconds) && machine_seconds >= 0) return "";
  return "it took " + shortest(machine_seconds) + " s by its own account; expected a finite number, not negative";
}

std::string flaw_of(const relign_stage_move& answer, const std::vector<double>& moved) {
  const std::size_t axes = moved.size();
  const std::uint64_t known_axes = axes >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << axes) - 1;
  if ((answer.limits_low | answer.limits_high) & ~known_axes)
    return "it tells limits of more than its " + std::to_string(axes) + " axes; bit i stands for axis i";
  for (std::size_t axis = 0; axis < axes; ++axis)
    if (!std::isfinite(moved[axis]))
      return "it tells that axis " + std::to_string(axis) + " moved by " + shortest(moved[axis]) +
             "; expected a share of the travel";
  return flaw_of_seconds(answer.machine_seconds);
}

}  // namespace

Scene::StageMove Scene::move_by(const std::vector<double>& delta) {
  Implementation& mine = *implementation_;
  const relign_scene_stage& stage = mine.own_stage("move_by");
  StageMove made;
  made.moved = delta;
  relign_stage_move answer{};
  answer.struct_size = sizeof answer;
  answer.moved = made.moved.data();
  const auto axes = static_cast<std::uint32_t>(delta.size());
  const relign_status status = mine.host.call(
      "move_by", [&](const FloatingPointState&) { return stage.move_by(mine.object, delta.data(), axes, &answer); });
  if (status != RELIGN_OK) mine.host.throw_failure("move_by", "it did not move and gives no reason");
  if (const std::string flaw = flaw_of(answer, made.moved); !flaw.empty()) mine.host.throw_failure("move_by", flaw);
  made.limits_low = answer.limits_low;
  made.limits_high = answer.limits_high;
  made.machine_seconds = answer.machine_seconds;
  return made;
}

double Scene::capture(float* pixels) {
  Implementation& mine = *implementation_;
  const relign_scene_stage& stage = mine.own_stage("capture");
  double machine_seconds = 0;
  const relign_status status = mine.host.call(
      "capture", [&](const FloatingPointState&) { return stage.capture(mine.object, pixels, &machine_seconds); });
  if (status != RELIGN_OK) mine.host.throw_failure("capture", "it captured nothing and gives no reason");
  if (const std::string flaw = flaw_of_seconds(machine_seconds); !flaw.empty())
    mine.host.throw_failure("capture", flaw);
  return machine_seconds;
}

MountedAssembly::MountedAssembly(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MountedAssembly::MountedAssembly(MountedAssembly&&) noexcept = default;
MountedAssembly::~MountedAssembly() = default;

void MountedAssembly::capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels) {
  Scene::Implementation& scene = *implementation_->scene;
  const relign_status status = scene.host.call("capture", [&](const FloatingPointState&) {
    return scene.table->capture(implementation_->object, true_pose.data(), static_cast<std::uint32_t>(true_pose.size()),
                                frame_seed, pixels);
  });
  if (status != RELIGN_OK) scene.host.throw_failure("capture", "it captured nothing and gives no reason");
}

MountedAssembly::Truth MountedAssembly::noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed) {
  Scene::Implementation& scene = *implementation_->scene;
  Truth truth{};
  const relign_status status = scene.host.call("noise_free_mse", [&](const FloatingPointState&) {
    return scene.table->noise_free_mse(implementation_->object, true_pose.data(),
                                       static_cast<std::uint32_t>(true_pose.size()), seed, &truth.mse,
                                       &truth.standard_error);
  });
  if (status != RELIGN_OK) scene.host.throw_failure("noise_free_mse", "it measured nothing and gives no reason");
  if (!std::isfinite(truth.mse) || !std::isfinite(truth.standard_error) || truth.standard_error < 0)
    scene.host.throw_failure("noise_free_mse", "value or standard error is no finite number");
  return truth;
}

bool MountedAssembly::render_noise_free(const std::vector<double>& true_pose, float* pixels) {
  Scene::Implementation& scene = *implementation_->scene;
  if (!scene.noise_free) return false;
  return scene.host.call("render_noise_free", [&](const FloatingPointState&) {
    return scene.noise_free->render(implementation_->object, true_pose.data(),
                                    static_cast<std::uint32_t>(true_pose.size()), pixels);
  }) == RELIGN_OK;
}

}  // namespace relign::plugin_host
