// Scene plugin: reads a scene file and hands everything optical to the imaging room.
#include <cstring>
#include <memory>
#include <mutex>
#include <relign/plugin.hpp>

#include "base/hash.h"
#include "base/json_source.h"
#include "imaging/camera.h"
#include "imaging/own_optimum.h"
#include "imaging/reference.h"
#include "imaging/scene_file.h"
#include "optics/assembly.h"

namespace {

using relign::Json;
namespace imaging = relign::imaging;
namespace optics = relign::optics;

// The scene's camera, used by one assembly at a time: assemblies may have threads of their own.
struct SharedCamera {
  imaging::Camera camera;
  imaging::OptimumFinder optimum;
  std::mutex mutex;
};

class LensAssembly final : public relign::Assembly {
 public:
  LensAssembly(const imaging::SceneFile& scene, const optics::Assembly& assembly, SharedCamera& shared,
               const imaging::Reference& reference)
      : scene_(scene), lens_(scene, assembly), shared_(shared), reference_(reference) {}

  void capture(const relign::Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    shared_.camera.capture(lens_, true_pose, frame_seed, pixels);
  }
  Truth noise_free_mse(const relign::Pose& true_pose, std::uint64_t seed) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    const imaging::MseEstimate estimate = shared_.camera.noise_free_mse(lens_, true_pose, seed, reference_);
    return {estimate.mse, estimate.standard_error};
  }
  bool render_noise_free(const relign::Pose& true_pose, float* pixels) override {
    constexpr std::uint64_t kPictureSeed = 3;  // the references have 1 and 2
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    shared_.camera.render_noise_free(lens_, true_pose, kPictureSeed, imaging::reference_samples(scene_) / 4, pixels);
    return true;
  }
  std::optional<Optimum> own_optimum(std::uint64_t seed) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    imaging::OwnOptimum found = shared_.optimum.find(lens_, seed);
    return Optimum{std::move(found.true_pose), {found.error.mse, found.error.standard_error}};
  }

 private:
  const imaging::SceneFile& scene_;
  imaging::MountedLens lens_;
  SharedCamera& shared_;
  const imaging::Reference& reference_;
};

class LensSystem final : public relign::Scene {
 public:
  explicit LensSystem(const relign::Parameters& given)
      : settings_{*imaging::transport_from_name(given.text("transport")),
                  *imaging::sampler_from_name(given.text("sampler")), static_cast<int>(given.integer("samples")),
                  given.number("sensor_albedo")},
        scene_(imaging::read_scene_file(given.text("scene"), choices(given))),
        parallel_(given.threads()),
        reference_(imaging::make_reference(scene_, settings_, parallel_, cache(given),
                                           [&given](const std::string& message) { given.warn(message); })),
        shared_{{scene_, settings_, parallel_}, {scene_, settings_, shared_.camera, parallel_, reference_}, {}} {}

  std::string describe() override {
    Json axes = Json::array();
    const char* shift_names[] = {"x", "y", "z"};
    const char* tilt_names[] = {"Rx", "Ry", "Rz"};
    for (std::size_t i = 0; i < 3; ++i) axes.push_back(axis(shift_names[i], "mm", scene_.travel.shift_mm[i]));
    for (std::size_t i = 0; i < scene_.travel.tilt_deg.size(); ++i)
      axes.push_back(axis(tilt_names[i], "deg", scene_.travel.tilt_deg[i]));
    Json elements = Json::array();
    Json geometry = {{"pivot_z_mm", scene_.lens.pivot_z_mm}, {"elements", Json::object()}};
    for (const optics::Element& element : scene_.lens.elements) {
      elements.push_back(element.name);
      geometry["elements"][element.name] = {{"front_z_mm", element.faces.front().z_mm},
                                            {"back_z_mm", element.faces.back().z_mm}};
    }
    Json files = Json::array();
    for (const auto& file : scene_.files) files.push_back(file.string());
    Json description = {
        {"name", scene_.name},
        {"summary", scene_.summary},
        {"axes", axes},
        {"nominal_pose", std::vector<double>(scene_.axes(), 0.5)},
        {"image", {{"width", scene_.sensor.width}, {"height", scene_.sensor.height}, {"white", white()}}},
        {"elements", elements},
        {"geometry", geometry},
        {"files", files}};
    if (!scene_.machine_time.is_null()) description["machine_time"] = scene_.machine_time;
    if (!scene_.spec.is_null()) description["spec"] = scene_.spec;
    return description.dump();
  }

  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    image.sample_format = RELIGN_SAMPLE_FLOAT32;
    image.width = static_cast<std::uint32_t>(scene_.sensor.width);
    image.height = static_cast<std::uint32_t>(scene_.sensor.height);
    image.channels = 1;
    image.pixels = reference_.mean.data();
    image.row_stride_bytes = image.width * sizeof(float);
    return image;
  }

  std::unique_ptr<relign::Assembly> mount(std::string_view offsets_json) override {
    const auto source = relign::JsonSource::from_text(std::string(offsets_json), "element offsets");
    const auto offsets = optics::read_offsets(source, "", scene_.lens);
    return std::make_unique<LensAssembly>(scene_, optics::Assembly(scene_.lens, offsets), shared_, reference_);
  }

 private:
  static imaging::SceneChoices choices(const relign::Parameters& given) {
    imaging::SceneChoices chosen;
    chosen.ambient_index = given.number("ambient_index");
    chosen.target = given.text("target");
    chosen.rotation_z = given.boolean("rotation_z");
    chosen.pixels = static_cast<int>(given.integer("pixels"));
    return chosen;
  }
  static imaging::ReferenceCache cache(const relign::Parameters& given) {
    return {given.cache_folder(), relign::sha256_file(given.plugin_folder() + "/lens_system.so")};
  }
  static Json axis(const char* name, const char* unit, double half) {
    return {{"name", name}, {"unit", unit}, {"lower", -half}, {"upper", half}};
  }
  // A lit pixel: the 99th percentile of O*.
  float white() const {
    std::vector<float> values = reference_.mean;
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
    std::nth_element(values.begin(), place, values.end());
    return *place > 0 ? *place : 1.0F;
  }

  imaging::CaptureSettings settings_;
  imaging::SceneFile scene_;
  imaging::Parallel parallel_;
  imaging::Reference reference_;
  SharedCamera shared_;
};

}  // namespace

RELIGN_PLUGIN(LensSystem)
