// Where a lens stands, from one capture and the pictures that its design would give.
#pragma once

#include <functional>

#include "design.hpp"

namespace sensitivity {

// What one capture tells.
struct Sight {
  Belief away;        // of the way from the best pose to this one
  Vector linearised;  // where the Jacobian was taken
  double misfit = 0;  // mean squared difference that is left, in units of what noise leaves
  double moved = 0;   // pixels that the picture goes by the last step
  double step = 0;    // its length, as a share of the travel
};

// Mean of captures, and the variance of a pixel of one.
struct Rendering {
  Picture mean;
  double noise = 0;
};

struct Registration {
  const Design& design;
  // The design at a distance from the nominal pose, as the mean of so many captures (two at least); the distance is
  // brought to that of a pose that there is. Empty: the reference and its one Jacobian have to do.
  std::function<Rendering(Vector& away, int captures)> render;
  int captures = 16;  // for one fine picture

  // before: what is believed of the distance without this capture.
  Sight operator()(const Picture& capture, const Belief& before, int most_comparisons) const;

 private:
  // A Jacobian far from the nominal pose: differences of binned captures, as long as the blur bears.
  Level linearise(const Vector& away, double blur) const;
  // Residual and what it tells by one level's Jacobian.
  Sight compare(const Picture& capture, const Belief& before, const Vector& away, const Level& level, bool far,
                bool finest) const;
};

// The picture moved so that what lies at (x + right, y + down) comes to (x, y); dark beyond the edge.
Picture shifted(const Picture& picture, Eigen::Index width, Eigen::Index height, double right, double down);

}  // namespace sensitivity
