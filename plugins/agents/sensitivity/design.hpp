// Sensitivities of the lens as designed: the Jacobian of its image by pose, at several blurs. Computed once per scene,
// from the simulator alone.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <vector>

#include "belief.hpp"
#include "least_squares/binning.hpp"
#include "least_squares/nuisance.hpp"

namespace sensitivity {

using Picture = Eigen::VectorXf;  // pixels row by row

// Least squares on blurred residuals. J'(blur r) = (blur J)'r, so only the Jacobian is blurred. J is the Jacobian
// without disturbances (Nuisance::without), as is its blurred form.
struct Level {
  Eigen::Index bin = 1;  // side of a bin, in pixels
  double blur = 0;       // standard deviation, in pixels before binning
  least_squares::Nuisance<float> nuisance;
  Eigen::MatrixXf gain;  // pixels x axes: the blurred Jacobian
  Matrix squares;        // J' blur J
  Matrix inverse;        // (J' blur J)^-1
  // Information of gain' r for white noise of variance 1 per pixel: with B = gain' gain, the covariance of gain' r, it
  // is J' blur J B^-1 J' blur J. `weigh` = J' blur J B^-1 turns gain' r into information * pose.
  Matrix information, weigh;
};

// The disturbances of an image, with stray light `stray`; none if that is empty. blur: of the level, in pixels. noise:
// variance of a pixel.
// Under a blur the errors of a Gauss-Newton step are correlated over its area, and less noise would let smooth fields
// absorb shifts of the image.
least_squares::Nuisance<float> disturbances(const Picture& image, const Picture& stray, Eigen::Index width,
                                            Eigen::Index height, double blur, double noise);

// jacobian: pixels x axes. noise: variance of its entries, one per column, which is subtracted from `squares`.
Level make_level(const Eigen::MatrixXf& jacobian, Eigen::Index width, Eigen::Index height, double blur,
                 const Vector& noise, least_squares::Nuisance<float> nuisance);

struct Design {
  Vector nominal;     // the best true pose of the lens as designed
  Picture reference;  // the scene's reference image
  // reference - noise-free image of the model: stray light that the model lacks. Empty: disturbances are not fitted.
  Picture stray;
  Eigen::Index width, height;  // of all images
  Eigen::MatrixXf jacobian;    // pixels x axes, at the nominal pose
  Matrix motion;               // 2 x axes: image shift to the right and down, in pixels per unit of each axis
  Matrix change;               // Gram matrix of the Jacobian without that shift, relative to the reference's square sum
  double noise = 0;            // variance of a pixel of a capture, mean over the image
  std::vector<Level> levels;   // the coarsest first; the last has no blur

  Eigen::Index axes() const { return nominal.size(); }
  // Relative change of the image at a displacement from the nominal pose, apart from its shift.
  double changed(const Vector& away) const { return std::sqrt(std::max(away.dot(change * away), 0.0)); }
};

// RMSE that the lens is expected to have at a pose beyond that of its optimum, if the RMSE of the optimum is much
// smaller, as the root of the expected square. best: belief about the optimum's pose. Without what the fit of
// disturbances takes up.
double expected_excess(const Design& design, const Belief& best, const Vector& pose);

// Images of the lens as designed at a true pose.
struct Simulator {
  std::function<Picture(const Vector& pose)> clean;                        // noise-free
  std::function<Picture(const Vector& pose, std::uint64_t seed)> capture;  // with the scene's noise
};

// first_blur: blur of the coarsest level, as a share of the image's shorter side. stray_light: fit disturbances.
Design study(const Simulator& simulator, const Vector& nominal, const Picture& reference, Eigen::Index width,
             Eigen::Index height, double first_blur, bool stray_light);

}  // namespace sensitivity
