#include "imaging/pose_motion.h"

namespace relign::imaging {

// By central differences: a pose acts through sines and cosines of angles far below 1, so that a step of 1e-4 leaves
// errors of 1e-10.
std::vector<Twist> twists_of_axes(const SceneFile& scene, const std::vector<double>& true_pose) {
  constexpr double kStep = 1e-4;
  std::vector<Twist> twists;
  const optics::Motion into_lens = inverse(scene.lens_to_world(true_pose));
  for (std::size_t axis = 0; axis < true_pose.size(); ++axis) {
    std::vector<double> low = true_pose, high = true_pose;
    low[axis] -= kStep;
    high[axis] += kStep;
    const optics::Motion from = after(into_lens, scene.lens_to_world(low));
    const optics::Motion to = after(into_lens, scene.lens_to_world(high));
    const auto slope = [&](double a, double b) { return (b - a) / (2 * kStep); };
    const auto turn = [&](std::size_t up, std::size_t down) {  // of the antisymmetric part
      return 0.5 * (slope(from.rotation[up], to.rotation[up]) - slope(from.rotation[down], to.rotation[down]));
    };
    twists.push_back({slope(from.translation.x, to.translation.x), slope(from.translation.y, to.translation.y),
                      slope(from.translation.z, to.translation.z), turn(7, 5), turn(2, 6), turn(3, 1)});
  }
  return twists;
}

}  // namespace relign::imaging
