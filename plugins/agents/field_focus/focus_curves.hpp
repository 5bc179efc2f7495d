// MTF through focus by field, and the pose that follows from it. No images: see field_focus.cpp for these.
//
// A field's defocus is zeta = z - slope . tilts, with z and tilts as commanded and the slopes of the design.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <optional>
#include <vector>

namespace field_focus {

using Focus = Eigen::Vector3d;  // z and two tilts, shares of the travel

struct Sample {
  Focus pose;
  double mtf;
};

// log MTF = peak - (zeta - centre)^2 / (2 width^2).
struct Curve {
  double peak, centre, width;
  double at(double zeta) const { return std::exp(peak - 0.5 * std::pow((zeta - centre) / width, 2)); }
};

// One direction of one field.
struct Channel {
  Eigen::Vector2d slope;  // of the field's best z over the tilts
  std::vector<Sample> samples;
  std::optional<Curve> curve;
  std::optional<double> limit = 0.0;  // of the specification; none: the field is not specified

  double defocus(const Focus& pose) const { return pose[0] - slope.dot(pose.tail<2>()); }
};

// Fits all curves, each by weighted least squares of a parabola to log MTF. `reach`: samples farther from `centre`
// (a pose) or from the channel's highest MTF count less, because curves are Gaussian only near the peak. Curves with
// too few samples take the median width of the others. Returns the number of fitted curves.
int fit(std::vector<Channel>& channels, const std::optional<Focus>& centre, double reach);

// The plane through the best foci of all curves by least squares.
Focus plane_of_best_focus(const std::vector<Channel>& channels);

// The pose at which the worst channel is farthest above its limit, within `reach` of `start` in every field; a soft
// minimum, so that errors of single curves average out. `start` if no channel with a limit has a curve.
Focus best_of_worst(const std::vector<Channel>& channels, const Focus& start, double reach);

}  // namespace field_focus
