#include "imaging/mounted_lens.h"

#include <algorithm>

namespace relign::imaging {
namespace {

// The places that a sensor can take in lens coordinates, over all poses.
optics::PlaceRange reachable(const SceneFile& scene) {
  const double half = scene.sensor.half_extent_mm();
  const double shift = std::max(scene.travel.shift_mm[0], scene.travel.shift_mm[1]);
  const double tilt = std::max(scene.travel.tilt_deg[0], scene.travel.tilt_deg[1]);
  const optics::SineCosine angle = optics::sine_cosine_of_degrees(tilt);
  const double corner = (half + shift) * (scene.travel.tilt_deg.size() > 2 ? 1.4143 : 1.0);
  const double sensor_from_first_vertex = scene.sensor.z_mm + scene.pivot_behind_first_vertex_mm;
  optics::PlaceRange range;
  range.half_width = corner + scene.sensor.z_mm * angle.sine + 0.1;
  const double deep = scene.travel.shift_mm[2] + 2 * corner * angle.sine + 0.01;
  range.z_low = sensor_from_first_vertex - deep;
  range.z_high = sensor_from_first_vertex + deep;
  return range;
}

}  // namespace

optics::PupilSearch search_pupil(const SceneFile& scene) { return {scene.lens, reachable(scene)}; }

MountedLens::MountedLens(const SceneFile& scene, const optics::Assembly& assembly)
    : assembly_(assembly),
      search_(scene.pupil ? scene.pupil : std::make_shared<optics::PupilSearch>(search_pupil(scene))),
      table_(assembly, *search_) {}

MountedLens::MountedLens(const SceneFile& scene) : MountedLens(scene, optics::Assembly(scene.lens)) {}

}  // namespace relign::imaging
