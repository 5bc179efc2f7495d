// What one more image can tell: the Cramer-Rao bound of the pose, as an error that remains.
//
// At the lens's own best pose an image has the mean m(pose) and in pixel i the variance v_i. An unbiased estimate of
// the pose from that image has no smaller covariance than C = (J' diag(1/v) J)^-1, with J = dm/dpose: the Fisher
// information of normal noise (Kay, Fundamentals of Statistical Signal Processing I, 3.9, without the term of the
// variance's own slope). Where the lens is then put, its mean squared error is larger than at its best pose by tr(J'J
// C) / pixels, to second order and without the images' curvature. Even noise of variance v gives axes * v / pixels,
// whatever the lens.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// `jacobian`: a row a pixel, a column an axis; `weights`: 1 / variance of each pixel, 0 where nothing is known of it.
// In squared units of the pixels. Axes that change nothing, or nothing that others do not, cost nothing.
double next_image_excess(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& weights);

// The variance of each pixel as a camera has it, a dark part and one that grows with the light (EMVA Standard 1288):
// the line through what was found in each pixel, which from a few captures is too rough to be a weight. Never below a
// thousandth of the mean one.
Eigen::VectorXd noise_law(const Eigen::VectorXd& mean, const Eigen::VectorXd& variance);

// Of a mounted lens at the true pose `optimum`: J by differences of noise-free images, the noise law of
// kCaptures captures whose seeds follow from `instance_seed`. 0 without noise; nothing where the scene renders no
// noise-free images, or takes longer than 3 s for one.
inline constexpr unsigned kCaptures = 8;
std::optional<double> next_image_excess(plugin_host::MountedAssembly& lens, const SceneFacts& scene,
                                        const std::vector<double>& optimum, std::uint64_t instance_seed);

}  // namespace relign::trials
