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
  double doubt = 0;  // additional standard deviation of log MTF, for near curves
};

// log MTF = peak - (zeta - centre)^2 / (2 width^2).
struct Curve {
  double peak, centre, width;
  double at(double zeta) const { return std::exp(peak - 0.5 * std::pow((zeta - centre) / width, 2)); }
};

// log MTF near a defocus: a polynomial in s = (zeta - middle) / reach.
struct NearCurve {
  using Powers = Eigen::Matrix<double, 5, 1>;
  double middle, reach;
  Powers coefficients;

  Powers powers(double zeta) const {
    const double s = (zeta - middle) / reach;
    return (Powers() << 1, s, s * s, s * s * s, s * s * s * s).finished();
  }
  double at(double zeta) const { return std::exp(coefficients.dot(powers(zeta))); }
};

// log MTF of the designed lens through focus, one direction of one field: a table about its best focus.
class DesignCurve {
 public:
  // Values at first, first + stride, ...; the best focus is between the second and the last but one.
  DesignCurve(double first, double stride, std::vector<double> log_mtf);
  double best() const { return best_; }
  DesignCurve above(double height) const { return {first_ + height, stride_, values_}; }  // raised by this
  double at(double away) const;  // from the best focus; beyond the table its end
  double slope(double away) const { return (at(away + 0.25 * stride_) - at(away - 0.25 * stride_)) / (0.5 * stride_); }

 private:
  double first_, stride_, best_;
  std::vector<double> values_;
};

// One direction of one field.
struct Channel {
  Eigen::Vector2d slope;  // of the field's best z over the tilts
  std::vector<Sample> samples;
  std::optional<double> limit = 0.0;  // of the specification; none: the field is not specified
  std::optional<Curve> curve = {};
  std::optional<NearCurve> near = {};

  double defocus(const Focus& pose) const { return pose[0] - slope.dot(pose.tail<2>()); }
};

// Fits all curves, each by weighted least squares of a parabola to log MTF. `reach`: samples farther from the channel's
// highest MTF count less, because curves are Gaussian only near the peak. Curves with too few samples take the median
// width of the others. Returns the number of fitted curves.
int fit(std::vector<Channel>& channels, double reach);

// Fits all near curves about a pose: the most probable polynomials by samples with noise and by what curves of lenses
// look like. Lenses with tolerances have no common shape of a whole curve, but any is a polynomial near a defocus.
// Channels with fewer than two samples get none. Returns the number of fitted curves.
int fit_near(std::vector<Channel>& channels, const Focus& pose, double reach);

// Fits all curves as the design's, shifted, with a factor and a polynomial of small coefficients besides: the most
// probable ones by samples with noise. Their centres start from those that the design would have at `pose`, which a
// channel without samples keeps. Zero is the design's plane of best focus.
void fit_by_design(std::vector<Channel>& channels, const std::vector<DesignCurve>& design, const Focus& pose,
                   double reach);

// The plane through the best foci of all curves by least squares.
Focus plane_of_best_focus(const std::vector<Channel>& channels);

// The pose at which the worst channel by the near curves is farthest above its limit, within `reach` of `start` in
// every field; a soft minimum, so that errors of single curves average out. `start` if no channel with a limit has such
// a curve.
Focus best_of_worst(const std::vector<Channel>& channels, const Focus& start, double reach);

}  // namespace field_focus
