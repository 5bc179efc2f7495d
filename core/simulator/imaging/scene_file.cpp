#include "imaging/scene_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/json_members.h"
#include "base/shared_keys.h"
#include "base/text.h"
#include "imaging/mounted_lens.h"
#include "imaging/target.h"
#include "optics/face_shape.h"

extern "C" {
extern const unsigned char relign_schema_scene[];
extern const unsigned long relign_schema_scene_size;
}

namespace relign::imaging {
namespace {

namespace fs = std::filesystem;

void read_emitter(const Json& file, const JsonSource& source, const fs::path& folder, const SceneChoices& choices,
                  SceneFile& scene) {
  scene.emitter.z_mm = file["z_mm"];
  scene.emitter.side_mm = file["side_mm"];
  scene.emitter.repeats = file["border"] == "repeat";
  // A path in the file is relative to the file's folder, one chosen by the user to the working directory.
  const bool chosen = !choices.target.empty();
  scene.emitter.target = chosen ? choices.target : file["target"].get<std::string>();
  std::optional<images::Image> drawn;
  try {
    drawn = draw_target(scene.emitter.target, file["texels"]);
  } catch (const Error& error) {
    if (chosen) throw;
    throw_if_any({source.problem("/emitter/target", error.what())});
  }
  if (drawn) return scene.emitter.show(std::move(*drawn));
  const fs::path image = chosen ? fs::path(scene.emitter.target) : folder / scene.emitter.target;
  scene.emitter.show(target_from_file(image));
  scene.files.push_back(image);
}

struct WeightedWavelength {
  double nm = 0, weight = 0;
};

// With weights whose sum is 1.
std::vector<WeightedWavelength> read_wavelengths(const Json& file, const JsonSource& source,
                                                 std::vector<Problem>& problems) {
  std::vector<WeightedWavelength> found;
  double sum = 0;
  for (const Json& one : list_of(file, "wavelengths")) {
    const double nm = one["nm"];
    for (const WeightedWavelength& other : found)
      if (other.nm == nm)
        problems.push_back(source.problem("/wavelengths/" + std::to_string(found.size()) + "/nm",
                                          "the wavelength " + shortest(nm) + " nm is listed twice; list each once"));
    found.push_back({nm, one["weight"]});
    sum += found.back().weight;
  }
  for (WeightedWavelength& one : found) one.weight /= sum;
  return found;
}

void divide_indices(optics::Prescription& lens, double ambient_index) {
  for (optics::Element& element : lens.elements)
    for (std::size_t f = 0; f + 1 < element.faces.size(); ++f) element.faces[f].index_after /= ambient_index;
}

// At the nominal pose the lens must be between emitter and sensor, and its travel must not reach the emitter.
void check_room(const SceneFile& scene, const std::filesystem::path& file) {
  const double front = scene.lens.elements.front().faces.front().z_mm - scene.pivot_behind_first_vertex_mm;
  const double rear = scene.lens.elements.back().faces.back().z_mm - scene.pivot_behind_first_vertex_mm;
  const auto refuse = [&](const std::string& message) {
    throw Error(ErrorKind::bad_input, file.string() + ": " + message);
  };
  if (scene.emitter.z_mm >= front - scene.travel.shift_mm[2])
    refuse("the lens reaches the emitter: its first vertex travels to z = " +
           significant(front - scene.travel.shift_mm[2], 6) +
           " mm, the emitter is at z = " + significant(scene.emitter.z_mm, 6) + " mm");
  if (scene.sensor.z_mm <= rear)
    refuse("the sensor, at z = " + significant(scene.sensor.z_mm, 6) +
           " mm, is inside the lens, whose last vertex is at z = " + significant(rear, 6) + " mm");
}

// Images of a lens that takes too long would never be finished.
void check_work(const optics::Prescription& lens, const optics::PupilSearch& search, const fs::path& file) {
  const optics::PupilSearch::Work& work = search.work();
  if (!(work.all() > optics::PupilSearch::kMostWork)) return;
  std::string message = file.string() + ": images would take too long: tracing a ray is as much work as crossing " +
                        significant(work.all(), 3) + " spherical faces, at most " +
                        shortest(optics::PupilSearch::kMostWork) + " are allowed; ";
  if (work.faces > work.searches)
    throw Error(ErrorKind::bad_input, message + "remove faces, or the polynomials of faces that need none");
  std::string most_bent;
  double bend = -1;
  for (const optics::Element& element : lens.elements)
    for (std::size_t f = 0; f < element.faces.size(); ++f) {
      const optics::Face& face = element.faces[f];
      if (face.is_conic()) continue;
      const double radius = optics::valid_radius(face), here = optics::bounds_of(face, radius).most_bent * radius;
      if (here <= bend) continue;
      bend = here;
      most_bent = "face " + std::to_string(f + 1) + " of '" + element.name + "'";
    }
  throw Error(ErrorKind::bad_input, message + "most of it finds the hits on polynomial faces, of which " + most_bent +
                                        " is bent most: reduce its high-order coefficients or its semi-diameter");
}

}  // namespace

const Schema& scene_schema() {
  static const Schema schema(relign_schema_scene, relign_schema_scene_size);
  return schema;
}

SceneFile read_scene_file(const fs::path& file, const SceneChoices& choices) {
  const JsonSource source = JsonSource::from_file(file);
  const fs::path folder = file.parent_path();
  std::vector<Problem> problems;
  SceneFile scene;
  scene.files.push_back(file);

  const Json top = scene_schema().checked(source, problems);
  scene.name = top["name"];
  scene.summary = top["summary"];
  const std::string lens_name = top["lens"];
  scene.pivot_behind_first_vertex_mm = top["pivot_behind_first_vertex_mm"];
  scene.diffraction = top["diffraction"];
  const std::vector<WeightedWavelength> wavelengths = read_wavelengths(top, source, problems);
  scene.sensor = read_sensor(top["sensor"], source, "/sensor", choices.pixels, choices.warp_um, problems);
  const Json& travel = top["travel"];
  std::copy_n(travel["shift_mm"].begin(), 3, scene.travel.shift_mm.begin());
  scene.travel.tilt_deg = travel["tilt_deg"].get<std::vector<double>>();
  if (choices.rotation_z) {
    scene.travel.tilt_deg.push_back(travel["rotation_z_deg"]);
    if (scene.travel.tilt_deg.back() <= 0)
      problems.push_back(
          source.problem("/travel", "parameter 'rotation_z' is on, but 'rotation_z_deg' gives it no travel"));
  }
  scene.machine_time = member(top, "machine_time");
  if (const auto spec = top.find("spec"); spec != top.end()) {
    check_specification(source, "/spec", problems);
    scene.spec = *spec;
    if (problems.empty() && spec->contains("mtf"))
      scene.diffraction_in_mtf = spec->at("mtf").value("diffraction", false);
  }
  scene.meshes = member(top, "meshes");
  if (top.contains("fields") && choices.target.empty() && choices.pixels == 0)
    scene.fields = images::read_edge_fields(source, "/fields", static_cast<std::size_t>(scene.sensor.width),
                                            static_cast<std::size_t>(scene.sensor.height), problems);
  throw_if_any(problems);
  read_emitter(top["emitter"], source, folder, choices, scene);

  scene.files.push_back(folder / lens_name);
  const JsonSource lens_source = JsonSource::from_file(folder / lens_name);
  if (wavelengths.size() == 1)
    scene.lens = optics::read_prescription_at(lens_source, wavelengths.front().nm);
  else
    scene.lens = optics::read_prescription(lens_source);
  if (scene.lens.has_mirrors())
    throw Error(ErrorKind::bad_input, (folder / lens_name).string() +
                                          ": the lens has mirrors, which images do not support ('lens info' and "
                                          "'lens draw' do)");
  scene.ambient_index = choices.ambient_index;
  divide_indices(scene.lens, choices.ambient_index);
  check_room(scene, file);
  if (wavelengths.size() > 1)
    for (const auto& [nm, weight] : wavelengths) {
      SceneWavelength one{weight, optics::read_prescription_at(lens_source, nm), nullptr};
      divide_indices(one.lens, choices.ambient_index);
      scene.wavelengths.push_back(std::move(one));
    }
  scene.pupil = std::make_shared<optics::PupilSearch>(search_pupil(scene, scene.lens));
  check_work(scene.lens, *scene.pupil, folder / lens_name);
  for (SceneWavelength& one : scene.wavelengths)
    one.pupil = std::make_shared<optics::PupilSearch>(search_pupil(scene, one.lens));
  return scene;
}

void Emitter::show(images::Image image) {
  radiance = std::move(image);
  // A periodic bitmap gets a frame of texels from the opposite border.
  const std::size_t texels = radiance.width, frame = repeats ? 1 : 0, side = texels + 2 * frame;
  const auto scaled = [&](std::size_t x, std::size_t y, float white) {
    return std::clamp(radiance.at((x + texels - frame) % texels, (y + texels - frame) % texels), 0.0F, 1.0F) * white;
  };
  bool eight_bits = true;
  for (std::size_t y = 0; y < side && eight_bits; ++y)
    for (std::size_t x = 0; x < side; ++x) {
      constexpr float kRounding = 1e-3F;
      const float value = scaled(x, y, 255.0F);
      eight_bits = eight_bits && std::fabs(value - std::round(value)) < kRounding;
    }
  const auto bits = [&](std::size_t x, std::size_t y, float white) {
    return static_cast<std::uint32_t>(std::lround(scaled(x, y, white)));
  };
  texels_8_bit.assign(eight_bits ? side * side + 1 : 0, 0);
  texels_16_bit.assign(eight_bits ? 0 : side * side + 1, 0);
  for (std::size_t y = 0; y < side; ++y)
    for (std::size_t x = 0; x < side; ++x) {
      if (eight_bits)
        texels_8_bit[y * side + x] =
            static_cast<std::uint16_t>(bits(x, y, 255.0F) | bits(x, std::min(y + 1, side - 1), 255.0F) << 8);
      else
        texels_16_bit[y * side + x] = bits(x, y, 65535.0F) | bits(std::min(x + 1, side - 1), y, 65535.0F) << 16;
    }
}

optics::EmitterPlane Emitter::plane() const {
  optics::EmitterPlane plane{};
  plane.distance_z = static_cast<float>(z_mm);
  plane.half_side = static_cast<float>(side_mm / 2);
  plane.texels = static_cast<std::int32_t>(radiance.width + (repeats ? 2 : 0));
  if (repeats) plane.texel_offset = 0.5F;
  plane.texels_per_mm = static_cast<float>(static_cast<double>(radiance.width) / side_mm);
  plane.texels_8_bit = texels_8_bit.empty() ? nullptr : texels_8_bit.data();
  plane.texels_16_bit = texels_16_bit.empty() ? nullptr : texels_16_bit.data();
  return plane;
}

double Emitter::radiance_at(double x_mm, double y_mm) const {
  const double half = side_mm / 2;
  if (!(std::fabs(x_mm) < half && std::fabs(y_mm) < half)) return 0;
  const double per_mm = static_cast<double>(radiance.width) / side_mm;
  const double last = static_cast<double>(radiance.width - 1);
  const double low = repeats ? -1 : 0, high = repeats ? last + 1 : last;
  const double u = std::clamp((x_mm + half) * per_mm - 0.5, low, high);
  const double v = std::clamp((y_mm + half) * per_mm - 0.5, low, high);
  const double column = std::min(std::floor(u), high - 1), row = std::min(std::floor(v), high - 1);
  const double fu = u - column, fv = v - row;
  const auto texel = [&](double x, double y) {
    const auto within = [&](double place) {  // -1 and last + 1: of a bitmap that repeats
      return static_cast<std::size_t>(place < 0 ? last : place > last ? 0 : place);
    };
    return static_cast<double>(radiance.at(within(x), within(y)));
  };
  const double above = (1 - fu) * texel(column, row) + fu * texel(column + 1, row);
  const double below = (1 - fu) * texel(column, row + 1) + fu * texel(column + 1, row + 1);
  return (1 - fv) * above + fv * below;
}

optics::Motion SceneFile::lens_to_world(const std::vector<double>& true_pose) const {
  const auto physical = [&](std::size_t axis, double half) { return (2 * true_pose[axis] - 1) * half; };
  const double rz = travel.tilt_deg.size() > 2 ? physical(5, travel.tilt_deg[2]) : 0;
  optics::Motion motion;
  motion.rotation = optics::rotation_of_degrees(physical(3, travel.tilt_deg[0]), physical(4, travel.tilt_deg[1]), rz);
  const optics::Vec3 pivot{0, 0, pivot_behind_first_vertex_mm};
  motion.translation =
      optics::Vec3{physical(0, travel.shift_mm[0]), physical(1, travel.shift_mm[1]), physical(2, travel.shift_mm[2])} -
      optics::turn(motion.rotation, pivot);
  return motion;
}

}  // namespace relign::imaging
