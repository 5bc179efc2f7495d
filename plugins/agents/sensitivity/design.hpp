// What is known of the lens as designed: how its picture changes with the pose, at several blurs. Computed once per
// scene, from its simulator alone.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <vector>

#include "belief.hpp"
#include "pictures/pictures.hpp"

namespace sensitivity {

using Picture = Eigen::VectorXf;  // pixels row by row

// Least squares on blurred residuals. J'(blur r) = (blur J)'r, so that only the Jacobian is ever blurred.
struct Level {
  Eigen::Index bin = 1;  // pixels a side that were put together
  double blur = 0;       // standard deviation, in pixels of the picture before that
  Eigen::MatrixXf gain;  // pixels x axes: the blurred Jacobian
  Matrix squares;        // J' blur J
  Matrix unfelt;         // its inverse
  // What `gain' r` tells when every pixel has white noise of variance 1: B = gain'gain is how noisy it is itself, so
  // that the information is J' blur J B^-1 J' blur J, and `weigh` = J' blur J B^-1 makes the weighed pose of gain'r.
  Matrix information, weigh;
};

// jacobian: pixels x axes. noise: variance of its entries, column by column, which would count as feeling.
Level make_level(const Eigen::MatrixXf& jacobian, Eigen::Index width, Eigen::Index height, double blur,
                 const Vector& noise);

struct Design {
  Vector nominal;              // the best true pose of the lens as designed
  Picture reference;           // as the scene tells it
  Eigen::Index width, height;  // of all pictures
  Eigen::MatrixXf jacobian;    // pixels x axes, at the nominal pose
  Matrix motion;               // 2 x axes: pixels that the whole picture goes right and down by a unit of each axis
  Matrix change;               // squares of what the Jacobian is besides, in shares of the reference's
  double noise = 0;            // variance of a pixel of a capture, mean over the picture
  std::vector<Level> levels;   // the coarsest first; the last has no blur

  Eigen::Index axes() const { return nominal.size(); }
  // By how much the picture at a distance from the nominal pose is another one, not only elsewhere.
  double changed(const Vector& away) const { return std::sqrt(std::max(away.dot(change * away), 0.0)); }
};

// The lens as designed at a true pose.
struct Simulator {
  std::function<Picture(const Vector& pose)> clean;                        // without noise
  std::function<Picture(const Vector& pose, std::uint64_t seed)> capture;  // with the scene's own
};

// first_blur: of the coarsest level, as a share of the picture's shorter side.
Design study(const Simulator& simulator, const Vector& nominal, const Picture& reference, Eigen::Index width,
             Eigen::Index height, double first_blur);

}  // namespace sensitivity
