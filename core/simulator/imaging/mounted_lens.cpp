#include "imaging/mounted_lens.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relign::imaging {
namespace {

// The positions of the sensor in lens coordinates, over all poses.
optics::PlaceRange reachable(const SceneFile& scene) {
  const double half = scene.sensor.half_extent_mm();
  const double shift = std::max(scene.travel.shift_mm[0], scene.travel.shift_mm[1]);
  const double tilt = std::max(scene.travel.tilt_deg[0], scene.travel.tilt_deg[1]);
  const optics::SineCosine angle = optics::sine_cosine_of_degrees(tilt);
  const double corner = (half + shift) * (scene.travel.tilt_deg.size() > 2 ? 1.4143 : 1.0);
  const double sensor_from_first_vertex = scene.sensor.z_mm + scene.pivot_behind_first_vertex_mm;
  optics::PlaceRange range;
  range.half_width = corner + scene.sensor.z_mm * angle.sine + 0.1;
  const double warped = std::fabs(scene.sensor.bow_per_mm) * 2 * half * half;
  const double deep = scene.travel.shift_mm[2] + 2 * corner * angle.sine + warped + 0.01;
  range.z_low = sensor_from_first_vertex - deep;
  range.z_high = sensor_from_first_vertex + deep;
  range.most_places /= 1 + static_cast<int>(scene.wavelengths.size());
  return range;
}

}  // namespace

optics::PupilSearch search_pupil(const SceneFile& scene, const optics::Prescription& lens) {
  return {lens, reachable(scene)};
}

std::vector<optics::Assembly> at_wavelengths(const SceneFile& scene, const optics::Assembly& assembly) {
  std::vector<optics::Motion> placements;
  for (std::size_t e = 0; e < assembly.lens().elements.size(); ++e) placements.push_back(assembly.placement(e));
  std::vector<optics::Assembly> all;
  for (const SceneWavelength& wavelength : scene.wavelengths)
    all.push_back(optics::Assembly::placed(wavelength.lens, placements));
  return all;
}

MountedLens::AtWavelength::AtWavelength(const optics::Assembly& of, std::shared_ptr<const optics::PupilSearch> how)
    : assembly(of), search(std::move(how)), table(assembly, *search) {}

MountedLens::MountedLens(const SceneFile& scene, const optics::Assembly& assembly) {
  const auto search = [&](const std::shared_ptr<const optics::PupilSearch>& known, const optics::Prescription& lens) {
    return known ? known : std::make_shared<optics::PupilSearch>(search_pupil(scene, lens));
  };
  at_wavelengths_.push_back(std::make_unique<AtWavelength>(assembly, search(scene.pupil, scene.lens)));
  const std::vector<optics::Assembly> others = at_wavelengths(scene, assembly);
  for (std::size_t i = 0; i < others.size(); ++i) {
    const SceneWavelength& one = scene.wavelengths[i];
    at_wavelengths_.push_back(std::make_unique<AtWavelength>(others[i], search(one.pupil, one.lens)));
  }
}

MountedLens::MountedLens(const SceneFile& scene) : MountedLens(scene, optics::Assembly(scene.lens)) {}

}  // namespace relign::imaging
