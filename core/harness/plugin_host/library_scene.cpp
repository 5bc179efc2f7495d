// Scenes in libraries.
#include <cstring>

#include "base/json_source.h"
#include "plugin_host/library_object.h"
#include "plugin_host/scene_backend.h"

namespace relign::plugin_host {
namespace {

using SceneObject = LibraryObject<relign_scene_interface, relign_scene>;

const relign_scene_interface& scene_table(const Manifest& manifest) {
  const auto& table = table_of<relign_scene_interface>(manifest, RELIGN_SCENE_INTERFACE);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "describe", table.describe);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "reference", table.reference);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "mount", table.mount);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "unmount", table.unmount);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "capture", table.capture);
  require_function(manifest, RELIGN_SCENE_INTERFACE, "noise_free_mse", table.noise_free_mse);
  return table;
}

// Whether a table has all of these functions.
template <class Table, class... Functions>
bool is_complete(const Table& table, Functions... functions) {
  return table.struct_size >= sizeof(Table) && ((table.*functions != nullptr) && ...);
}

template <class List>
std::uint32_t count_of(const List& list) {
  return static_cast<std::uint32_t>(list.size());
}

std::vector<std::uint32_t> to_numbers(const std::vector<Region>& regions) {
  std::vector<std::uint32_t> numbers;
  for (const Region& region : regions)
    numbers.insert(numbers.end(), {region.column, region.row, region.columns, region.rows});
  return numbers;
}

#include "ability_tables.inc"

std::string description_of(SceneObject& scene) {
  const TextSink description;
  scene.demand("describe", "it returned no description and no reason",
               [&] { return scene.table().describe(scene.get(), description.sink()); });
  return description.text();
}

class LibraryAssembly final : public AssemblyBackend {
 public:
  LibraryAssembly(SceneObject& scene, const AbilityTables& tables, const std::string& offsets_json)
      : scene_(scene), tables_(tables) {
    scene_.demand("mount", "it returned no assembly and no reason", [&] {
      const relign_status status =
          scene_.table().mount(scene_.get(), {offsets_json.data(), offsets_json.size()}, &object_);
      return status == RELIGN_OK && !object_ ? RELIGN_UNSUPPORTED : status;
    });
  }
  ~LibraryAssembly() override {
    scene_.quietly([this] { scene_.table().unmount(object_); });
  }

  relign_assembly* get() const { return object_; }

  void capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels) override {
    scene_.demand("capture", "it returned no image and no reason", [&] {
      return scene_.table().capture(object_, true_pose.data(), count_of(true_pose), frame_seed, pixels);
    });
  }

  MountedAssembly::Truth noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed) override {
    MountedAssembly::Truth truth{};
    scene_.demand("noise_free_mse", "it returned no value and no reason", [&] {
      return scene_.table().noise_free_mse(object_, true_pose.data(), count_of(true_pose), seed, &truth.mse,
                                           &truth.standard_error);
    });
    return truth;
  }

#include "library_abilities.inc"

 private:
  template <class Table, class Body>
  bool offers(const Table* table, const char* what, const Body& body) {
    return table && scene_.offers(what, "it returned no result and no reason", body);
  }
  std::size_t axes() {
    const Json description = parsed_json(description_of(scene_));
    return description.is_object() && description.contains("axes") ? description["axes"].size() : 0;
  }

  SceneObject& scene_;
  const AbilityTables tables_;
  relign_assembly* object_ = nullptr;
};

class LibraryScene final : public SceneBackend {
 public:
  LibraryScene(const Choice& choice, const HostServices& services)
      : object_(choice, services, scene_table(*choice.plugin)) {
    const relign_scene_interface& table = object_.table();
    if (!RELIGN_HAS_MEMBER(&table, get_extension) || !table.get_extension) return;
    object_.demand("get_extension", "", [&] {
      for_each_ability(tables_,
                       [&](const char*, const char* id, auto& found, auto function) { find(found, id, function); });
      find(batch_, RELIGN_SCENE_BATCH, &relign_scene_batch::open, &relign_scene_batch::capture,
           &relign_scene_batch::noise_free_mse);
      stage_ = static_cast<const relign_scene_stage*>(extension(RELIGN_SCENE_STAGE));
      return RELIGN_OK;
    });
    if (!stage_) return;
    if (!is_complete(*stage_, &relign_scene_stage::begin, &relign_scene_stage::move_by, &relign_scene_stage::capture))
      refuse("get_extension", std::string(RELIGN_SCENE_STAGE) + " lacks begin, move_by or capture");
  }

  std::string describe() override { return description_of(object_); }

  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    object_.demand("reference", "it returned no image and no reason",
                   [&] { return object_.table().reference(object_.get(), &image); });
    return image;
  }

  std::unique_ptr<AssemblyBackend> mount(const std::string& offsets_json) override {
    return std::make_unique<LibraryAssembly>(object_, tables_, offsets_json);
  }

  bool offers(std::string_view ability) override {
    bool found = false;
    for_each_ability(tables_, [&](std::string_view name, const char*, const auto* table, auto) {
      found = found || (name == ability && table);
    });
    return found;
  }

  std::string open_gpu() override {
    if (!batch_) return SceneBackend::open_gpu();
    const TextSink why;
    const bool offered =
        object_.offers("open", "it returned no reason", [&] { return batch_->open(object_.get(), why.sink()); });
    if (offered) return "";
    return why.text().empty() ? "it gave no reason" : why.text();
  }

  std::vector<double> capture_batch(const Batch& batch, const std::vector<std::uint32_t>& places,
                                    float* images) override {
    std::vector<double> rmse(batch.seeds.size(), -1);
    with_table(batch, [&](const relign_batch& table, std::uint32_t axes) {
      object_.demand("capture_batch", "it returned no images and no reason",
                     [&] { return batch_->capture(object_.get(), &table, axes, places.data(), images, rmse.data()); });
    });
    return rmse;
  }

  std::vector<MountedAssembly::Truth> mse_batch(const Batch& batch) override {
    std::vector<double> mse(batch.seeds.size()), error(batch.seeds.size(), -1);
    with_table(batch, [&](const relign_batch& table, std::uint32_t axes) {
      object_.demand("mse_batch", "it returned no values and no reason",
                     [&] { return batch_->noise_free_mse(object_.get(), &table, axes, mse.data(), error.data()); });
    });
    std::vector<MountedAssembly::Truth> truths;
    for (std::size_t i = 0; i < mse.size(); ++i) truths.push_back({mse[i], error[i]});
    return truths;
  }

  bool offers_stage() const override { return stage_ != nullptr; }

  void begin(std::uint64_t seed) override {
    object_.demand("begin", "it did not start and gave no reason", [&] { return stage_->begin(object_.get(), seed); });
  }

  Scene::StageMove move_by(const std::vector<double>& delta) override {
    Scene::StageMove made;
    made.moved = delta;
    relign_stage_move answer{};
    answer.struct_size = sizeof answer;
    answer.moved = made.moved.data();
    object_.demand("move_by", "it did not move and gave no reason",
                   [&] { return stage_->move_by(object_.get(), delta.data(), count_of(delta), &answer); });
    made.limits_low = answer.limits_low;
    made.limits_high = answer.limits_high;
    made.machine_seconds = answer.machine_seconds;
    return made;
  }

  double capture(float* pixels) override {
    double machine_seconds = 0;
    object_.demand("capture", "it returned no image and no reason",
                   [&] { return stage_->capture(object_.get(), pixels, &machine_seconds); });
    return machine_seconds;
  }

  [[noreturn]] void refuse(const char* what, const std::string& message) override {
    object_.host().throw_failure(what, message);
  }

 private:
  const void* extension(const char* id) { return object_.table().get_extension(object_.get(), {id, std::strlen(id)}); }
  // Null unless the scene offers the ability with all of its functions.
  template <class Table, class... Functions>
  void find(const Table*& ability, const char* id, Functions... functions) {
    ability = static_cast<const Table*>(extension(id));
    if (ability && !is_complete(*ability, functions...)) ability = nullptr;
  }

  // Calls body(the batch as the plugin gets it, number of axes).
  template <class Body>
  void with_table(const Batch& batch, const Body& body) {
    if (batch.seeds.empty()) return;
    std::vector<relign_assembly*> assemblies;
    for (AssemblyBackend* assembly : batch.assemblies)
      assemblies.push_back(static_cast<LibraryAssembly*>(assembly)->get());
    body(relign_batch{sizeof(relign_batch), static_cast<std::uint32_t>(assemblies.size()), assemblies.data(),
                      batch.true_poses.data(), batch.seeds.data()},
         static_cast<std::uint32_t>(batch.true_poses.size() / batch.seeds.size()));
  }

  SceneObject object_;
  AbilityTables tables_;
  const relign_scene_batch* batch_ = nullptr;  // null when not offered
  const relign_scene_stage* stage_ = nullptr;  // null when not offered
};

}  // namespace

std::unique_ptr<SceneBackend> make_library_scene(const Choice& choice, const HostServices& services) {
  return std::make_unique<LibraryScene>(choice, services);
}

}  // namespace relign::plugin_host
