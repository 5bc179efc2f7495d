#include "imaging/reference.h"

#include <cstring>

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"

namespace relign::imaging {
namespace {

std::string bytes_of(const std::vector<float>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

// File format: "relign-reference 1\n", the SHA-256 of the renders, a line feed, both renders.
constexpr char kMagic[] = "relign-reference 1\n";

bool load(const std::filesystem::path& file, std::size_t count, Reference& reference) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) return false;
  const std::string content = read_file(file);
  const std::size_t header = sizeof kMagic - 1 + 65;
  const std::size_t size = count * sizeof(float);
  if (content.size() != header + 2 * size || content.compare(0, sizeof kMagic - 1, kMagic) != 0) return false;
  if (content.compare(sizeof kMagic - 1, 64, sha256_hex(std::string_view(content).substr(header))) != 0) return false;
  reference.first.resize(count);
  reference.second.resize(count);
  std::memcpy(reference.first.data(), content.data() + header, size);
  std::memcpy(reference.second.data(), content.data() + header + size, size);
  return true;
}

// Copies the renders once: those of large sensors take hundreds of megabytes.
std::string file_text(const Reference& reference) {
  const std::size_t size = reference.first.size() * sizeof(float), hash = sizeof kMagic - 1, header = hash + 65;
  std::string text;
  text.reserve(header + 2 * size);
  text.append(kMagic).append(64, '0').append("\n");
  for (const std::vector<float>* render : {&reference.first, &reference.second})
    text.append(reinterpret_cast<const char*>(render->data()), size);
  text.replace(hash, 64, sha256_hex(std::string_view(text).substr(header)));
  return text;
}

}  // namespace

int reference_samples(const SceneFile& scene) {
  constexpr std::size_t kRays = 40960000;  // 1024 for each of 200 x 200 pixels
  int samples = 1024;
  while (samples > 64 && static_cast<std::size_t>(samples) * scene.sensor.pixels() > kRays) samples /= 2;
  return samples;
}

int reference_samples(const SceneFile& scene, const optics::BlockTracer* tracer) {
  return reference_samples(scene) / (tracer ? 16 : 1);
}

std::string scene_content_hash(const SceneFile& scene, const CaptureSettings& settings) {
  Json content = {{"pivot", scene.pivot_behind_first_vertex_mm},
                  {"sensor",
                   {scene.sensor.z_mm, scene.sensor.pitch_mm, scene.sensor.width, scene.sensor.height,
                    scene.sensor.left_mm, scene.sensor.top_mm}},
                  {"emitter", {scene.emitter.z_mm, scene.emitter.side_mm}},
                  {"radiance", sha256_hex(bytes_of(scene.emitter.radiance.values))},
                  {"texels", scene.emitter.radiance.width},
                  {"travel", {scene.travel.shift_mm, scene.travel.tilt_deg}},
                  {"transport", name_of(settings.transport)},
                  {"lens_pivot", scene.lens.pivot_z_mm},
                  {"samples", reference_samples(scene)}};
  for (const optics::Element& element : scene.lens.elements) {
    if (!element.placement.is_identity()) {
      const auto& [rotation, shift] = element.placement;
      content["placements"].push_back({element.name, rotation, {shift.x, shift.y, shift.z}});
    }
    for (const optics::Face& face : element.faces) {
      content["faces"].push_back({element.name, face.z_mm, face.curvature, face.index_after, face.clear_radius_mm});
      if (!face.is_sphere()) content["shapes"].push_back({content["faces"].size(), face.conic, face.even_asphere});
      if (face.r2_term != 0 || !face.odd_asphere.empty() || !face.over_root.empty())
        content["more_shapes"].push_back({content["faces"].size(), face.r2_term, face.odd_asphere, face.over_root});
    }
  }
  for (const optics::Stop& stop : scene.lens.stops) {
    content["stops"].push_back({stop.z_mm, stop.opening_radius_mm});
    if (stop.before_face) content["placed_stops"].push_back({content["stops"].size(), *stop.before_face, stop.on_face});
  }
  if (scene.lens.barrel)
    content["mount"] = {scene.lens.barrel->bore_radius_mm, scene.lens.barrel->from_z_mm, scene.lens.barrel->to_z_mm};
  for (const SceneWavelength& wavelength : scene.wavelengths) {
    Json indices = Json::array();
    for (const optics::Element& element : wavelength.lens.elements)
      for (const optics::Face& face : element.faces) indices.push_back(face.index_after);
    content["wavelengths"].push_back({wavelength.lens.wavelength_nm, wavelength.weight, indices});
  }
  if (scene.sensor.bow_per_mm != 0) content["sensor_bow"] = scene.sensor.bow_per_mm;
  for (const PixelBox& window : scene.sensor.windows)
    content["windows"].push_back({window.column, window.row, window.columns, window.rows});
  if (scene.diffraction) content["diffraction"] = {scene.lens.wavelength_nm, scene.ambient_index};
  if (scene.emitter.repeats) content["emitter_border"] = "repeat";
  if (settings.transport == Transport::ghost) content["sensor_albedo"] = settings.sensor_albedo;
  return short_hash(canonical_json(content));
}

namespace {

// Transport ghost: 170 reflected paths per pixel for each of the two renders of 1024 rays.
constexpr int kRaysPerReferenceGhost = 6;

// Certifies the design at the nominal pose and at some others. Cached references were rendered by the same code after
// this check.
void certify(Camera& camera, MountedLens& lens, const SceneFile& scene) {
  constexpr int kPoses = 6, kPixels = 64;
  constexpr std::uint64_t kSeed = 0x63657274;
  std::vector<double> pose(scene.axes(), 0.5);
  if (camera.certify(lens, pose, {}, kSeed) == 0)
    throw Error(ErrorKind::bad_input,
                "scene '" + scene.name +
                    "': no light of the target reaches the sensor at the nominal pose; check that the stop is open (to "
                    "f/10000 at least) and that target, lens and sensor are in line");
  Random random(kSeed, 1);
  for (int i = 0; i < kPoses; ++i) {
    for (double& value : pose) value = random.uniform();
    camera.certify(lens, pose, {0, kPixels}, kSeed + 1 + static_cast<std::uint64_t>(i));
  }
}

}  // namespace

Reference make_reference(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel,
                         const ReferenceCache& cache, const std::function<void(const std::string&)>& warn,
                         optics::BlockTracer* tracer) {
  const auto count = scene.sensor.pixels();
  Reference reference;
  std::filesystem::path file;
  if (!cache.folder.empty())
    file = cache.folder / ("reference-" + short_hash(cache.renderer + scene_content_hash(scene, settings)) + ".bin");
  if (file.empty() || !load(file, count, reference)) {
    reference.first.resize(count);
    reference.second.resize(count);
    const std::vector<double> nominal(scene.axes(), 0.5);
    Camera camera(scene, settings, parallel, tracer);
    const int samples = reference_samples(scene, tracer);
    MountedLens lens(scene);
    certify(camera, lens, scene);
    camera.render_noise_free(lens, nominal, 1, samples, reference.first.data(), kRaysPerReferenceGhost);
    camera.render_noise_free(lens, nominal, 2, samples, reference.second.data(), kRaysPerReferenceGhost);
    if (!file.empty()) {
      try {
        write_file_atomically(file, file_text(reference));
      } catch (const Error& error) {
        if (warn) warn(std::string("cannot cache the reference image: ") + error.what());
      }
    }
  }
  reference.mean.resize(count);
  for (std::size_t i = 0; i < count; ++i) reference.mean[i] = 0.5F * (reference.first[i] + reference.second[i]);
  return reference;
}

}  // namespace relign::imaging
