#include "imaging/pose_motion.h"

namespace relign::imaging {
namespace {

// By central differences: motions depend on a parameter through sines and cosines of angles far below 1, so that a step
// of 1e-4 leaves errors of 1e-10.
constexpr double kStep = 1e-4;

Twist slope(const optics::Motion& from, const optics::Motion& to) {
  const auto shift = [](double a, double b) { return (b - a) / (2 * kStep); };
  const auto turn = [&](std::size_t up, std::size_t down) {  // of the antisymmetric part
    return 0.5 * (shift(from.rotation[up], to.rotation[up]) - shift(from.rotation[down], to.rotation[down]));
  };
  return {shift(from.translation.x, to.translation.x),
          shift(from.translation.y, to.translation.y),
          shift(from.translation.z, to.translation.z),
          turn(7, 5),
          turn(2, 6),
          turn(3, 1)};
}

}  // namespace

std::vector<Twist> twists_of_axes(const SceneFile& scene, const std::vector<double>& true_pose) {
  std::vector<Twist> twists;
  const optics::Motion into_lens = inverse(scene.lens_to_world(true_pose));
  for (std::size_t axis = 0; axis < true_pose.size(); ++axis) {
    std::vector<double> low = true_pose, high = true_pose;
    low[axis] -= kStep;
    high[axis] += kStep;
    twists.push_back(slope(after(into_lens, scene.lens_to_world(low)), after(into_lens, scene.lens_to_world(high))));
  }
  return twists;
}

std::vector<Twist> twists_of_offset(double pivot_z_mm, const optics::ElementOffset& offset) {
  const auto motion = [&](std::size_t number, double by) {
    std::vector<double> shift = offset.shift_mm, tilt = offset.tilt_deg;
    (number < shift.size() ? shift[number] : tilt[number - shift.size()]) += by;
    return optics::about({0, 0, pivot_z_mm}, tilt, {shift[0], shift[1], shift[2]});
  };
  std::vector<Twist> twists;
  const optics::Motion back = inverse(motion(0, 0));
  for (std::size_t number = 0; number < offset.shift_mm.size() + offset.tilt_deg.size(); ++number)
    twists.push_back(slope(after(motion(number, -kStep), back), after(motion(number, kStep), back)));
  return twists;
}

}  // namespace relign::imaging
