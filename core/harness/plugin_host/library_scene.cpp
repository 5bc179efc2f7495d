// Scenes in libraries.
#include <cstring>

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

std::uint32_t axes_of(const std::vector<double>& pose) { return static_cast<std::uint32_t>(pose.size()); }

// Null for abilities that the scene does not offer.
struct Abilities {
  const relign_scene_noise_free* noise_free = nullptr;
  const relign_scene_optimum* optimum = nullptr;
  const relign_scene_mtf* mtf = nullptr;
  const relign_scene_average* average = nullptr;
  const relign_scene_fields* fields = nullptr;
  const relign_scene_regions* regions = nullptr;
  const relign_scene_batch* batch = nullptr;
};

class LibraryAssembly final : public AssemblyBackend {
 public:
  LibraryAssembly(SceneObject& scene, const Abilities& can, const std::string& offsets_json)
      : scene_(scene), can_(can) {
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
      return scene_.table().capture(object_, true_pose.data(), axes_of(true_pose), frame_seed, pixels);
    });
  }

  double capture_regions(const std::vector<double>& true_pose, std::uint64_t frame_seed, const PixelRegions& regions,
                         float* pixels) override {
    const std::vector<std::uint32_t> numbers = to_numbers(regions);
    double share = -1;
    scene_.demand("capture_regions", "it returned no image and no reason", [&] {
      return can_.regions->capture(object_, true_pose.data(), axes_of(true_pose), frame_seed, numbers.data(),
                                   static_cast<std::uint32_t>(regions.size()), pixels, &share);
    });
    return share;
  }

  MountedAssembly::Truth noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed) override {
    MountedAssembly::Truth truth{};
    scene_.demand("noise_free_mse", "it returned no value and no reason", [&] {
      return scene_.table().noise_free_mse(object_, true_pose.data(), axes_of(true_pose), seed, &truth.mse,
                                           &truth.standard_error);
    });
    return truth;
  }

  bool render_noise_free(const std::vector<double>& true_pose, float* pixels) override {
    if (!can_.noise_free) return false;
    return scene_.host().call("render_noise_free", [&](const FloatingPointState&) {
      return can_.noise_free->render(object_, true_pose.data(), axes_of(true_pose), pixels);
    }) == RELIGN_OK;
  }

  std::optional<MountedAssembly::Average> render_average(const std::vector<double>& true_pose, std::uint64_t seed,
                                                         double error, std::uint64_t samples, float* pixels) override {
    if (!can_.average) return std::nullopt;
    relign_average reached{};
    reached.struct_size = sizeof reached;
    const bool offered = scene_.offers("render_average", "it returned no image and no reason", [&] {
      return can_.average->render(object_, true_pose.data(), axes_of(true_pose), seed, error, samples, pixels,
                                  &reached);
    });
    if (!offered) return std::nullopt;
    return MountedAssembly::Average{reached.standard_error, reached.samples};
  }

  std::optional<MountedAssembly::Optimum> own_optimum(std::uint64_t seed, std::size_t axes) override {
    if (!can_.optimum) return std::nullopt;
    MountedAssembly::Optimum found;
    found.true_pose.resize(axes);
    const bool offered = scene_.offers("own_optimum", "it returned no optimum and no reason", [&] {
      return can_.optimum->find(object_, seed, found.true_pose.data(), static_cast<std::uint32_t>(axes),
                                &found.truth.mse, &found.truth.standard_error);
    });
    return offered ? std::optional(found) : std::nullopt;
  }

  std::optional<MountedAssembly::FieldMtf> mtf(const std::vector<double>& true_pose, double lp_per_mm) override {
    if (!can_.mtf) return std::nullopt;
    relign_field_mtf told{};
    told.struct_size = sizeof told;
    const bool offered = scene_.offers("mtf", "it returned no MTF and no reason", [&] {
      return can_.mtf->measure(object_, true_pose.data(), axes_of(true_pose), lp_per_mm, &told);
    });
    if (!offered) return std::nullopt;
    return MountedAssembly::FieldMtf{told.centre, told.corner};
  }

  std::vector<MountedAssembly::FieldValues> fields(const std::vector<double>& true_pose, double lp_per_mm,
                                                   const std::vector<std::uint32_t>& which) override {
    if (!can_.fields) return {};
    std::vector<double> x(which.size()), y = x, tangential = x, sagittal = x;
    relign_field_values values{};
    values.struct_size = sizeof values;
    values.count = static_cast<std::uint32_t>(which.size());
    values.fields = which.data();
    values.x_px = x.data();
    values.y_px = y.data();
    values.tangential = tangential.data();
    values.sagittal = sagittal.data();
    const bool offered = scene_.offers("fields", "it returned no fields and no reason", [&] {
      return can_.fields->measure(object_, true_pose.data(), axes_of(true_pose), lp_per_mm, &values);
    });
    std::vector<MountedAssembly::FieldValues> found;
    for (std::size_t i = 0; offered && i < which.size(); ++i) found.push_back({x[i], y[i], tangential[i], sagittal[i]});
    return found;
  }

 private:
  SceneObject& scene_;
  const Abilities can_;
  relign_assembly* object_ = nullptr;
};

class LibraryScene final : public SceneBackend {
 public:
  LibraryScene(const Choice& choice, const HostServices& services)
      : object_(choice, services, scene_table(*choice.plugin)) {
    const relign_scene_interface& table = object_.table();
    if (!RELIGN_HAS_MEMBER(&table, get_extension) || !table.get_extension) return;
    object_.demand("get_extension", "", [&] {
      find(can_.noise_free, RELIGN_SCENE_NOISE_FREE, &relign_scene_noise_free::render);
      find(can_.optimum, RELIGN_SCENE_OPTIMUM, &relign_scene_optimum::find);
      find(can_.mtf, RELIGN_SCENE_MTF, &relign_scene_mtf::measure);
      find(can_.average, RELIGN_SCENE_AVERAGE, &relign_scene_average::render);
      find(can_.fields, RELIGN_SCENE_FIELDS, &relign_scene_fields::measure);
      find(can_.regions, RELIGN_SCENE_REGIONS, &relign_scene_regions::capture);
      find(can_.batch, RELIGN_SCENE_BATCH, &relign_scene_batch::open, &relign_scene_batch::capture,
           &relign_scene_batch::noise_free_mse);
      stage_ = static_cast<const relign_scene_stage*>(extension(RELIGN_SCENE_STAGE));
      return RELIGN_OK;
    });
    if (!stage_) return;
    if (!is_complete(*stage_, &relign_scene_stage::begin, &relign_scene_stage::move_by, &relign_scene_stage::capture))
      refuse("get_extension", std::string(RELIGN_SCENE_STAGE) + " lacks begin, move_by or capture");
  }

  std::string describe() override {
    const TextSink description;
    object_.demand("describe", "it returned no description and no reason",
                   [&] { return object_.table().describe(object_.get(), description.sink()); });
    return description.text();
  }

  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    object_.demand("reference", "it returned no image and no reason",
                   [&] { return object_.table().reference(object_.get(), &image); });
    return image;
  }

  std::unique_ptr<AssemblyBackend> mount(const std::string& offsets_json) override {
    return std::make_unique<LibraryAssembly>(object_, can_, offsets_json);
  }

  bool captures_regions() override { return can_.regions != nullptr; }

  std::string open_gpu() override {
    if (!can_.batch) return SceneBackend::open_gpu();
    const TextSink why;
    const bool offered =
        object_.offers("open", "it returned no reason", [&] { return can_.batch->open(object_.get(), why.sink()); });
    if (offered) return "";
    return why.text().empty() ? "it gave no reason" : why.text();
  }

  std::vector<double> capture_batch(const Batch& batch, const std::vector<std::uint32_t>& places,
                                    float* images) override {
    std::vector<double> rmse(batch.seeds.size(), -1);
    with_table(batch, [&](const relign_batch& table, std::uint32_t axes) {
      object_.demand("capture_batch", "it returned no images and no reason", [&] {
        return can_.batch->capture(object_.get(), &table, axes, places.data(), images, rmse.data());
      });
    });
    return rmse;
  }

  std::vector<MountedAssembly::Truth> mse_batch(const Batch& batch) override {
    std::vector<double> mse(batch.seeds.size()), error(batch.seeds.size(), -1);
    with_table(batch, [&](const relign_batch& table, std::uint32_t axes) {
      object_.demand("mse_batch", "it returned no values and no reason",
                     [&] { return can_.batch->noise_free_mse(object_.get(), &table, axes, mse.data(), error.data()); });
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
                   [&] { return stage_->move_by(object_.get(), delta.data(), axes_of(delta), &answer); });
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
  Abilities can_;
  const relign_scene_stage* stage_ = nullptr;  // null when not offered
};

}  // namespace

std::unique_ptr<SceneBackend> make_library_scene(const Choice& choice, const HostServices& services) {
  return std::make_unique<LibraryScene>(choice, services);
}

}  // namespace relign::plugin_host
