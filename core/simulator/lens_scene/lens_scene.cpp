#include "lens_scene/lens_scene.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/hash.h"
#include "base/json_source.h"
#include "imaging/chart_fields.h"
#include "imaging/pose_motion.h"
#include "optics/assembly.h"

namespace relign::lens_scene {
namespace {

imaging::ReferenceCache cache(const Parameters& given, const std::string& library, const std::string& tracer_hash) {
  return {given.cache_folder(), sha256_file(given.plugin_folder() + "/" + library) + tracer_hash};
}

Json axis(const char* name, const char* unit, double half) {
  return {{"name", name}, {"unit", unit}, {"lower", -half}, {"upper", half}};
}

}  // namespace

class LensScene::Mounted final : public relign::Assembly {
 public:
  Mounted(LensScene& of, std::map<std::string, optics::ElementOffset> offsets)
      : of_(of), offsets_(std::move(offsets)), lens_(of.scene_, {of.scene_.lens, offsets_}), shared_(of.shared_) {}

  void capture(const Pose& true_pose, std::uint64_t frame_seed, float* pixels) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    certify_once(true_pose);
    if (!shared_.errors || !shared_.errors->draw(frame_seed)) {
      shared_.camera.capture(lens_, true_pose, frame_seed, pixels);
      return;
    }
    shared_.camera.capture(lens_, true_pose, frame_seed, pixels, shared_.errors->into_print());
    shared_.errors->apply(pixels);
  }
  std::optional<double> capture_regions(const Pose& true_pose, std::uint64_t frame_seed,
                                        const std::vector<Region>& regions, float* pixels) override {
    PixelRegions read;
    for (const Region& region : regions) read.push_back({region.column, region.row, region.columns, region.rows});
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    certify_once(true_pose);
    return shared_.camera.capture_regions(lens_, true_pose, frame_seed, read, pixels);
  }
  Truth noise_free_mse(const Pose& true_pose, std::uint64_t seed) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    certify_once(true_pose);
    const imaging::MseEstimate estimate = shared_.camera.noise_free_mse(lens_, true_pose, seed, of_.reference_);
    return {estimate.mse, estimate.standard_error};
  }
  bool render_noise_free(const Pose& true_pose, float* pixels) override {
    constexpr std::uint64_t kPictureSeed = 3;  // the references have 1 and 2
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    certify_once(true_pose);
    const int samples = imaging::reference_samples(of_.scene_, of_.tracer_.get()) / 4;
    shared_.camera.render_noise_free(lens_, true_pose, kPictureSeed, samples, pixels);
    return true;
  }
  std::optional<Average> render_average(const Pose& true_pose, std::uint64_t seed, double error, std::uint64_t samples,
                                        float* pixels) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    certify_once(true_pose);
    imaging::NoiseFreeRequest request;
    request.seed = seed;
    request.error = error;
    request.samples = static_cast<long>(std::min<std::uint64_t>(samples, 1000000000));
    request.batch = std::max(1, imaging::reference_samples(of_.scene_, of_.tracer_.get()) / 4);
    const imaging::NoiseFreeResult reached = shared_.camera.render_noise_free(lens_, true_pose, request, pixels);
    return Average{reached.standard_error, static_cast<std::uint64_t>(reached.samples)};
  }
  bool render_slopes(const Pose& true_pose, std::uint64_t seed, std::uint32_t samples,
                     const std::vector<std::uint32_t>& elements, float* pixels) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    if (shared_.camera.without_derivatives()) return false;
    certify_once(true_pose);
    const optics::Prescription& lens = of_.scene_.lens;
    imaging::MovingParts parts;
    parts.elements.assign(elements.begin(), elements.end());
    std::vector<std::vector<imaging::Twist>> twists{imaging::twists_of_axes(of_.scene_, true_pose)};
    for (const std::uint32_t element : elements) {
      const auto offset = offsets_.find(lens.elements.at(element).name);
      twists.push_back(imaging::twists_of_offset(lens.pivot_z_mm,
                                                 offset == offsets_.end() ? optics::ElementOffset{} : offset->second));
    }
    const std::size_t count = of_.scene_.sensor.pixels();
    std::vector<float> wrenches(optics::kWrenchNumbers * parts.count() * count);
    constexpr std::uint32_t kGroup = 0;
    shared_.camera.render_derivatives(lens_, true_pose, seed, kGroup, static_cast<int>(std::min(samples, kMostSamples)),
                                      parts, pixels, wrenches.data());
    for (std::size_t part = 0; part < parts.count(); ++part)
      for (const imaging::Twist& twist : twists[part]) {
        pixels += count;
        for (std::size_t i = 0; i < count; ++i) {
          const float* wrench = &wrenches[twist.size() * (parts.count() * i + part)];
          double slope = 0;
          for (std::size_t k = 0; k < twist.size(); ++k) slope += twist[k] * static_cast<double>(wrench[k]);
          pixels[i] = static_cast<float>(slope);
        }
      }
    return true;
  }
  std::optional<Optimum> own_optimum(std::uint64_t seed) override {
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    imaging::OwnOptimum found = shared_.optimum.find(lens_, seed);
    return Optimum{std::move(found.true_pose), found.error.mse, found.error.standard_error};
  }
  std::optional<FieldMtf> mtf(const Pose& true_pose, double lp_per_mm) override {
    if (of_.tracer_) return std::nullopt;  // it traces rays from the sensor to the target only
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    if (!of_.mtf_)
      of_.mtf_.emplace(of_.scene_, of_.settings_.transport != imaging::Transport::refract,
                       of_.scene_.diffraction_in_mtf);
    const imaging::FieldMtf found = of_.mtf_->measure(lens_.assembly(), true_pose, lp_per_mm);
    return FieldMtf{found.centre, found.corner};
  }

  std::vector<FieldValues> fields(const Pose& true_pose, double lp_per_mm,
                                  const std::vector<std::uint32_t>& which) override {
    if (of_.tracer_) return {};  // as for mtf
    const std::lock_guard<std::mutex> lock(shared_.mutex);
    if (!of_.field_meter_)
      of_.field_meter_.emplace(FieldMeter{
          imaging::points_of_fields(of_.scene_),
          {of_.scene_, of_.settings_.transport != imaging::Transport::refract, of_.scene_.diffraction_in_mtf, kCells}});
    const imaging::Sensor& sensor = of_.scene_.sensor;
    std::vector<FieldValues> values(which.size());
    of_.parallel_.for_each(static_cast<int>(which.size()), [&](int item, unsigned) {
      const auto i = static_cast<std::size_t>(item);
      const imaging::Modulation found = of_.field_meter_->meter.modulation_at(of_.field_meter_->points.at(which[i]),
                                                                              lens_.assembly(), true_pose, lp_per_mm);
      values[i] = {(found.x_mm - sensor.left_mm) / sensor.pitch_mm - 0.5,
                   (sensor.top_mm - found.y_mm) / sensor.pitch_mm - 0.5, found.tangential, found.sagittal};
    });
    return values;
  }

  // For images that are rendered elsewhere; with the camera locked.
  imaging::MountedLens& certified(const Pose& true_pose) {
    certify_once(true_pose);
    return lens_;
  }
  imaging::MountedLens& lens() { return lens_; }

 private:
  static constexpr int kCells = 40;  // MTF within 0.02 of that of 100
  static constexpr std::uint32_t kMostSamples = 1U << 20;
  // A lens as built passes other directions than the design: checks its first image against rays in all directions.
  void certify_once(const Pose& true_pose) {
    if (lens_.is_certified()) return;
    shared_.camera.certify(lens_, true_pose, imaging::kFirstImageRays, imaging::kFirstImageSeed);
    lens_.set_certified();
  }

  LensScene& of_;
  std::map<std::string, optics::ElementOffset> offsets_;
  imaging::MountedLens lens_;
  SharedCamera& shared_;
};

Parts read_parts(const Parameters& given) {
  imaging::SceneChoices chosen;
  chosen.ambient_index = given.number("ambient_index");
  chosen.target = given.text("target");
  chosen.rotation_z = given.boolean("rotation_z");
  chosen.pixels = static_cast<int>(given.integer("pixels"));
  chosen.warp_um = given.number("sensor_warp");
  Parts parts;
  parts.settings.transport = *imaging::transport_from_name(given.text("transport"));
  parts.settings.sampler = *imaging::sampler_from_name(given.text("sampler"));
  parts.settings.samples = static_cast<int>(given.integer("samples"));
  parts.scene = imaging::read_scene_file(given.text("scene"), chosen);
  return parts;
}

void read_windows_only(Parts& parts, int pixels) {
  const auto refuse = [&parts](bool has, const std::string& what) {
    if (has)
      throw Error(ErrorKind::bad_input,
                  "scene '" + parts.scene.name + "': windows cannot be combined with " + what + "; use whole frames");
  };
  refuse(parts.scene.diffraction, "diffraction in images");
  refuse(parts.settings.transport == imaging::Transport::ghost, "transport 'ghost'");
  refuse(parts.errors.has_value(), "imaging errors");
  const imaging::Sensor& sensor = parts.scene.sensor;
  if (const int largest = std::min(sensor.width, sensor.height); pixels > largest)
    throw Error(ErrorKind::bad_input, "scene '" + parts.scene.name + "': windows of " + std::to_string(pixels) +
                                          " pixels do not fit the sensor of " + std::to_string(sensor.width) + " x " +
                                          std::to_string(sensor.height) + " pixels; at most " +
                                          std::to_string(largest) + ", or 0 for whole frames");
  parts.scene.sensor.windows = imaging::windows_around_fields(parts.scene, pixels);
}

LensScene::LensScene(const Parameters& given, Parts parts, const std::string& library)
    : settings_(parts.settings),
      scene_(std::move(parts.scene)),
      tracer_(std::move(parts.tracer)),
      parallel_(given.threads()),
      reference_(imaging::make_reference(
          scene_, settings_, parallel_, cache(given, library, parts.tracer_hash),
          [&given](const std::string& message) { given.warn(message); }, tracer_.get())),
      shared_{{scene_, settings_, parallel_, tracer_.get()},
              {scene_, settings_, shared_.camera, parallel_, reference_},
              {},
              {}} {
  if (parts.errors)
    shared_.errors.emplace(*parts.errors, scene_.sensor, static_cast<double>(white()), scene_.emitter.side_mm);
}

std::string LensScene::describe() {
  Json axes = Json::array();
  const char* shift_names[] = {"x", "y", "z"};
  const char* tilt_names[] = {"Rx", "Ry", "Rz"};
  for (std::size_t i = 0; i < 3; ++i) axes.push_back(axis(shift_names[i], "mm", scene_.travel.shift_mm[i]));
  for (std::size_t i = 0; i < scene_.travel.tilt_deg.size(); ++i)
    axes.push_back(axis(tilt_names[i], "deg", scene_.travel.tilt_deg[i]));
  // Faces are surfaces of revolution, so that the design looks the same however it is turned; meshes need not.
  constexpr std::size_t kRotationZ = 5;
  if (axes.size() > kRotationZ && !tracer_) axes[kRotationZ]["observable"] = false;
  Json elements = Json::array();
  Json geometry = {{"pivot_z_mm", scene_.lens.pivot_z_mm}, {"elements", Json::object()}};
  for (const optics::Element& element : scene_.lens.elements) {
    elements.push_back(element.name);
    geometry["elements"][element.name] = {{"front_z_mm", element.faces.front().z_mm},
                                          {"back_z_mm", element.faces.back().z_mm}};
  }
  Json files = Json::array();
  for (const auto& file : scene_.files) files.push_back(file.string());
  Json description = {{"name", scene_.name},
                      {"summary", scene_.summary},
                      {"axes", axes},
                      {"nominal_pose", std::vector<double>(scene_.axes(), 0.5)},
                      {"image", {{"width", scene_.sensor.width}, {"height", scene_.sensor.height}, {"white", white()}}},
                      {"elements", elements},
                      {"geometry", geometry},
                      {"files", files}};
  if (!scene_.machine_time.is_null()) description["machine_time"] = machine_time();
  if (!scene_.spec.is_null()) description["spec"] = scene_.spec;
  if (images::EdgeFields fields = imaging::fields_of(scene_); !fields.empty()) {
    for (std::size_t i = 0; i < scene_.sensor.windows.size(); ++i) {  // one around each field
      const imaging::PixelBox& window = scene_.sensor.windows[i];
      const auto pixels = [](int count) { return static_cast<std::size_t>(count); };
      fields[i].window = {pixels(window.column), pixels(window.row), pixels(window.columns), pixels(window.rows)};
    }
    description["fields"] = images::to_json(fields);
    description["pitch_um"] = std::round(1e9 * scene_.sensor.pitch_mm) / 1e6;
  }
  return description.dump();
}

relign_image LensScene::reference() {
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

std::unique_ptr<relign::Assembly> LensScene::mount(std::string_view offsets_json) {
  const auto source = JsonSource::from_text(std::string(offsets_json), "element offsets");
  const auto offsets = optics::read_offsets(source, "", scene_.lens);
  return std::make_unique<Mounted>(*this, offsets);
}

#if RELIGN_HAS_GPU
std::string LensScene::open_gpu() {
  if (on_gpu_) return "";
  const std::string start = "scene '" + scene_.name + "': the GPU simulator does not support ";
  if (tracer_) return start + "meshes";
  if (std::string problem = gpu::unsupported(scene_, settings_); !problem.empty()) return problem;
  try {
    on_gpu_ = std::make_unique<OnGpu>(*this);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// Each lens checked, as before its first image on the CPU, unless the GPU does it. With the camera locked.
std::vector<imaging::BatchItem> LensScene::on_gpu(const std::vector<BatchItem>& items) {
  std::vector<imaging::BatchItem> batch;
  for (const BatchItem& item : items) {
    auto& mounted = *static_cast<Mounted*>(item.assembly);
    imaging::MountedLens& lens = on_gpu_->camera.certifies() ? mounted.lens() : mounted.certified(item.true_pose);
    batch.push_back({&lens, &item.true_pose, item.seed, nullptr});
  }
  return batch;
}

std::vector<double> LensScene::capture_batch(const std::vector<BatchItem>& items,
                                             const std::vector<std::uint32_t>& places, float* images) {
  const std::lock_guard<std::mutex> lock(shared_.mutex);
  return on_gpu_->camera.capture(on_gpu(items), places, images);
}

std::vector<relign::Assembly::Truth> LensScene::mse_batch(const std::vector<BatchItem>& items) {
  std::vector<relign::Assembly::Truth> truths;
  if (settings_.transport == imaging::Transport::ghost) {  // no kernel
    for (const BatchItem& item : items) truths.push_back(item.assembly->noise_free_mse(item.true_pose, item.seed));
    return truths;
  }
  const std::lock_guard<std::mutex> lock(shared_.mutex);
  for (const imaging::MseEstimate& estimate : on_gpu_->camera.noise_free_mse(on_gpu(items)))
    truths.push_back({estimate.mse, estimate.standard_error});
  return truths;
}
#endif

// The scene file's; only pixels that are read out take time.
Json LensScene::machine_time() const {
  Json times = scene_.machine_time;
  if (const auto readout = times.find("readout_ms"); readout != times.end() && !scene_.sensor.windows.empty())
    *readout = readout->get<double>() * shared_.camera.share_read_out();
  return times;
}

// The level of a lit pixel: the 99th percentile of O*, of the pixels that are read out.
float LensScene::white() const {
  std::vector<float> values;
  for (const PixelSpan& span : shared_.camera.spans()) {
    const auto first = reference_.mean.begin() + static_cast<std::ptrdiff_t>(span.first);
    values.insert(values.end(), first, first + static_cast<std::ptrdiff_t>(span.count));
  }
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), place, values.end());
  return *place > 0 ? *place : 1.0F;
}

}  // namespace relign::lens_scene
