// Centring: how far the image goes with each axis, learnt from every move, and the pose that brings it back.
#ifndef THROUGH_FOCUS_CENTRING_HPP
#define THROUGH_FOCUS_CENTRING_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "sharpness.hpp"

namespace through_focus {

class Centring {
 public:
  // Moves shorter than `probe` tell more noise than response.
  Centring(std::size_t axes, double probe) : probe_(probe), response_(axes, {0, 0}), learnt_(axes, false) {}

  // What a move says. An axis that moves for the first time gets the whole of what the others do not explain; later
  // the smallest change that explains it (Broyden).
  void learn(const Seen& before, const Seen& after) {
    if (!before.look.placed || !after.look.placed) return;
    const std::size_t axes = response_.size();
    std::vector<double> move(axes);
    double square = 0;
    std::size_t fresh = axes, fresh_count = 0;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      move[axis] = after.pose[axis] - before.pose[axis];
      square += move[axis] * move[axis];
      if (!learnt_[axis] && std::fabs(move[axis]) > 1e-9) {
        fresh = axis;
        ++fresh_count;
      }
    }
    if (fresh_count > 1 || !(square > 1e-12)) return;
    for (std::size_t side = 0; side < 2; ++side) {
      double rest = after.look.shift[side] - before.look.shift[side];
      for (std::size_t axis = 0; axis < axes; ++axis) rest -= response_[axis][side] * move[axis];
      if (fresh_count == 1) {
        response_[fresh][side] += rest / move[fresh];
        continue;
      }
      for (std::size_t axis = 0; axis < axes; ++axis)
        response_[axis][side] += rest * move[axis] / (square + probe_ * probe_);
    }
    if (fresh_count == 1) learnt_[fresh] = true;
  }

  // `pose` with the axes across such that the image comes to the middle, by what these captures say on average; nothing
  // where they cannot tell. With more `axes` all of them share the way, each as it helps: the smallest move.
  std::optional<relign::Pose> centred(const std::vector<Seen>& captures, relign::Pose pose,
                                      const std::vector<std::size_t>& axes = {0, 1}) const {
    if (response_.size() < 2 || !learnt_[0] || !learnt_[1]) return std::nullopt;
    double off[2] = {0, 0}, count = 0;
    for (const Seen& seen : captures) {
      if (!seen.look.placed) continue;
      ++count;
      for (std::size_t side = 0; side < 2; ++side) {
        off[side] += seen.look.shift[side];
        for (std::size_t axis = 0; axis < pose.size(); ++axis)
          off[side] += response_[axis][side] * (pose[axis] - seen.pose[axis]);
      }
    }
    if (count == 0) return std::nullopt;
    double a = 0, b = 0, c = 0;  // response times its transpose
    for (const std::size_t axis : axes) {
      const auto& response = response_[axis];
      a += response[0] * response[0];
      b += response[0] * response[1];
      c += response[1] * response[1];
    }
    const double determinant = a * c - b * b;
    if (!(determinant > 1e-4 * (a + c) * (a + c))) return std::nullopt;  // all of them move it the same way
    const double right = (off[0] * c - off[1] * b) / determinant / count;
    const double down = (off[1] * a - off[0] * b) / determinant / count;
    for (const std::size_t axis : axes) pose[axis] -= response_[axis][0] * right + response_[axis][1] * down;
    return pose;
  }

 private:
  double probe_;
  std::vector<std::array<double, 2>> response_;  // pixels right and down per share of the travel, by axis
  std::vector<bool> learnt_;
};

}  // namespace through_focus

#endif  // THROUGH_FOCUS_CENTRING_HPP
