// Estimates the pose of a lens from one capture, by comparison with images of the lens as designed.
#pragma once

#include <functional>

#include "design.hpp"

namespace sensitivity {

constexpr double kWorse = 0.02;  // differences of misfits up to here are noise

// The result for one capture.
struct Estimate {
  Belief away;        // the displacement from the best pose to the pose of the capture
  Vector linearised;  // where the Jacobian was taken
  double misfit = 0;  // mean squared residual, relative to that of noise alone
  double moved = 0;   // image shift of the last Gauss-Newton step, in pixels
  double step = 0;    // length of that step, as a share of the travel
};

// Mean of captures, and the variance of a pixel of a single one.
struct Rendering {
  Picture mean;
  double noise = 0;
};

struct Registration {
  const Design& design;
  // Renders the lens as designed at displacement `away` from the nominal pose, as the mean of `captures` (at least 2),
  // and clamps `away` to the travel. If empty, the reference image and the Jacobian at the nominal pose are used.
  std::function<Rendering(Vector& away, int captures)> render;
  int captures = 16;           // per image at the finest level
  bool use_reference = false;  // near the nominal pose, compare with the reference image instead of rendering

  // before: the belief about the displacement without this capture.
  Estimate operator()(const Picture& capture, const Belief& before, int most_comparisons) const;

 private:
  // The Jacobian far from the nominal pose, from differences of binned captures with strides that suit the blur.
  Level linearise(const Vector& away, double blur) const;
  // One Gauss-Newton step with the Jacobian of a level.
  Estimate compare(const Picture& capture, const Belief& before, const Vector& away, const Level& level, bool far,
                   bool finest) const;
};

// Bilinear shift: the result at (x, y) is the image at (x + right, y + down), 0 beyond the edge.
Picture shifted(const Picture& picture, Eigen::Index width, Eigen::Index height, double right, double down);

}  // namespace sensitivity
