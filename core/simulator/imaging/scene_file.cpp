#include "imaging/scene_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/shared_keys.h"
#include "base/text.h"
#include "imaging/mounted_lens.h"
#include "imaging/target.h"
#include "optics/face_shape.h"

namespace relign::imaging {
namespace {

namespace fs = std::filesystem;

void read_emitter(ObjectReader& reader, const fs::path& folder, const SceneChoices& choices, SceneFile& scene) {
  scene.emitter.z_mm = reader.required_number("z_mm", -1e7, -1e-3);
  scene.emitter.side_mm = reader.required_number("side_mm", 1e-6, 1e7);
  scene.emitter.target = reader.string("target", "siemens_star");
  const auto texels = static_cast<int>(reader.integer("texels", 300, 2, 8192));
  const std::string border = reader.string("border", "clamp");
  if (border != "clamp" && border != "repeat")
    reader.complain("border", "found '" + border + "'; allowed: clamp, repeat");
  scene.emitter.repeats = border == "repeat";
  // A path in the file is relative to the file's folder, one chosen by the user to the working directory.
  const bool chosen = !choices.target.empty();
  if (chosen) scene.emitter.target = choices.target;
  std::optional<images::Image> drawn;
  try {
    drawn = draw_target(scene.emitter.target, texels);
  } catch (const Error& error) {
    if (chosen) throw;
    reader.complain("target", error.what());
    return;
  }
  if (drawn) {
    scene.emitter.show(std::move(*drawn));
    return;
  }
  const fs::path file = chosen ? fs::path(scene.emitter.target) : folder / scene.emitter.target;
  scene.emitter.show(target_from_file(file));
  scene.files.push_back(file);
}

struct WeightedWavelength {
  double nm = 0, weight = 0;
};

std::vector<WeightedWavelength> read_wavelengths(const JsonSource& source, ObjectReader& top,
                                                 std::vector<Problem>& problems) {
  std::vector<WeightedWavelength> found;
  const Json* list = top.get("wavelengths");
  if (!list) return found;
  if (!list->is_array() || list->empty() || list->size() > kMaxWavelengths) {
    top.complain("wavelengths", "expected a list of 1 to " + std::to_string(kMaxWavelengths) +
                                    " wavelengths, each {\"nm\": ..., \"weight\": ...}");
    return found;
  }
  double sum = 0;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader reader(source, top.pointer_to("wavelengths") + "/" + std::to_string(i), problems);
    WeightedWavelength one;
    one.nm = reader.required_number("nm", 1, 1e6);
    one.weight = reader.number("weight", 1, 1e-9, 1e9);
    reader.reject_unknown();
    for (const WeightedWavelength& other : found)
      if (other.nm == one.nm)
        reader.complain("nm", "the wavelength " + shortest(one.nm) + " nm is listed twice; list each once");
    sum += one.weight;
    found.push_back(one);
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

SceneFile read_scene_file(const fs::path& file, const SceneChoices& choices) {
  const JsonSource source = JsonSource::from_file(file);
  const fs::path folder = file.parent_path();
  std::vector<Problem> problems;
  SceneFile scene;
  scene.files.push_back(file);

  ObjectReader top(source, "", problems);
  top.string("use", "lens_system");
  top.integer("format", 1, 1, 1);
  scene.name = top.required_string("name");
  scene.summary = top.string("summary", "");
  const std::string lens_name = top.required_string("lens");
  scene.pivot_behind_first_vertex_mm = top.required_number("pivot_behind_first_vertex_mm", -1e6, 1e6);
  scene.diffraction = top.boolean("diffraction", false);
  const std::vector<WeightedWavelength> wavelengths = read_wavelengths(source, top, problems);
  for (const char* key : {"sensor", "emitter", "travel"})
    if (!top.get(key)) top.complain_missing(key, "an object");

  scene.sensor = read_sensor(source, "/sensor", choices.pixels, problems);

  ObjectReader travel(source, "/travel", problems);
  const std::vector<double> shift = travel.numbers("shift_mm", 3, {1, 1, 1});
  scene.travel.tilt_deg = travel.numbers("tilt_deg", 2, {0, 0});
  const double rz = travel.number("rotation_z_deg", 0, 0, 180);
  travel.reject_unknown();
  for (std::size_t i = 0; i < 3; ++i) {
    scene.travel.shift_mm[i] = shift[i];
    if (!(shift[i] >= 0))
      travel.complain("shift_mm", "expected half travels of 0 or more, found " + shortest(shift[i]));
  }
  for (const double tilt : scene.travel.tilt_deg)
    if (!(tilt >= 0 && tilt <= 45))
      travel.complain("tilt_deg", "expected half travels from 0 to 45 degrees, found " + shortest(tilt));
  if (choices.rotation_z) {
    if (rz <= 0) travel.complain("", "parameter 'rotation_z' is on, but 'rotation_z_deg' gives it no travel");
    scene.travel.tilt_deg.push_back(rz);
  }
  if (const Json* value = top.get("machine_time")) {
    read_machine_time(source, "/machine_time", problems);
    scene.machine_time = *value;
  }
  if (const Json* value = top.get("spec")) {
    check_specification(source, "/spec", problems);
    scene.spec = *value;
    if (problems.empty() && value->contains("mtf"))
      scene.diffraction_in_mtf = (*value)["mtf"].value("diffraction", false);
  }
  if (const Json* value = top.get("meshes")) scene.meshes = *value;
  if (top.get("fields")) {
    const bool as_in_file = choices.target.empty() && choices.pixels == 0;
    const auto width = static_cast<std::size_t>(scene.sensor.width),
               height = static_cast<std::size_t>(scene.sensor.height);
    if (as_in_file) scene.fields = images::read_edge_fields(source, "/fields", width, height, problems);
  }

  ObjectReader emitter(source, "/emitter", problems);
  if (problems.empty())
    read_emitter(emitter, folder, choices, scene);
  else
    for (const char* key : {"z_mm", "side_mm", "target", "texels", "border"}) emitter.get(key);
  emitter.reject_unknown();
  top.reject_unknown();
  throw_if_any(problems);

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
