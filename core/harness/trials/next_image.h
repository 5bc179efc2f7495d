// The information in one more image: the Cramer-Rao bound on the pose, expressed as the error that remains.
//
// At the lens's own best pose an image has the mean m(pose) and in pixel i the variance v_i. An unbiased estimate of
// the pose from that image has at least the covariance C = (J' diag(1/v) J)^-1, with J = dm/dpose: the inverse Fisher
// information of normal noise (Kay, Fundamentals of Statistical Signal Processing I, 3.9, without the term of the
// variance's derivative). At the estimated pose the mean squared error exceeds that at the best pose by tr(J'J C) /
// pixels, to second order and without the images' curvature. For uniform noise of variance v this is axes * v / pixels
// for any lens.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// `jacobian`: a row per pixel, a column per axis; `weights`: 1 / variance of each pixel, 0 where it is unknown. The
// result is in squared pixel values. Axes without an effect of their own on the image add nothing.
double next_image_excess(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& weights);

// Models the variance of each pixel as a constant plus a part proportional to the signal (EMVA Standard 1288): fits a
// line to the measured perturbations, which from few captures are too rough to serve as weights. At least a thousandth
// of the mean variance.
Eigen::VectorXd noise_law(const Eigen::VectorXd& mean, const Eigen::VectorXd& variance);

// For a mounted lens at the true pose `optimum`: J from differences of noise-free images, the noise law from kCaptures
// captures whose seeds follow from `instance_seed`. 0 without noise; nothing where the scene cannot render noise-free
// images, or takes longer than 3 s for one.
inline constexpr unsigned kCaptures = 8;
std::optional<double> next_image_excess(plugin_host::MountedAssembly& lens, const SceneFacts& scene,
                                        const std::vector<double>& optimum, std::uint64_t instance_seed);

}  // namespace relign::trials
