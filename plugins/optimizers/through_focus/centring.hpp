// Centring: estimates the image shift per axis from all moves, and the pose that centres the image.
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
  // probe: moves shorter than this measure noise rather than the response.
  Centring(std::size_t axes, double probe) : probe_(probe), response_(axes, {0, 0}), learnt_(axes, false) {}

  // Updates the response from a move. An axis that moves for the first time is assigned the entire unexplained shift;
  // later moves cause the smallest change that explains them (Broyden).
  void learn(const Capture& before, const Capture& after) {
    if (!before.metrics.placed || !after.metrics.placed) return;
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
      double rest = after.metrics.shift[side] - before.metrics.shift[side];
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

  // Returns `pose` with the given axes changed by the smallest move that centres the image, based on the mean over the
  // captures; nothing if the response does not determine it.
  std::optional<relign::Pose> centred(const std::vector<Capture>& captures, relign::Pose pose,
                                      const std::vector<std::size_t>& axes = {0, 1}) const {
    if (response_.size() < 2 || !learnt_[0] || !learnt_[1]) return std::nullopt;
    double off[2] = {0, 0}, count = 0;
    for (const Capture& capture : captures) {
      if (!capture.metrics.placed) continue;
      ++count;
      for (std::size_t side = 0; side < 2; ++side) {
        off[side] += capture.metrics.shift[side];
        for (std::size_t axis = 0; axis < pose.size(); ++axis)
          off[side] += response_[axis][side] * (pose[axis] - capture.pose[axis]);
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
    if (!(determinant > 1e-4 * (a + c) * (a + c)))
      return std::nullopt;  // all of them shift the image in the same direction
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
