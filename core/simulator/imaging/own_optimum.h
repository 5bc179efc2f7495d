// Finds the pose with the lowest noise-free MSE of a lens as built, which an ideal algorithm would reach.
//
// Coarse: least squares over rays. Rays from points on the sensor should hit the emitter where those of the perfect
// lens at the nominal pose do: one Gauss-Newton problem in the pose, smooth, with a wide basin. Fine:
// Levenberg-Marquardt on the image residual, with noise-free renders of one seed, so that images differ only by pose;
// every step is checked on the noise-free MSE. Under transport ghost the search uses images without stray light, which
// cost a hundredth: stray light carries no information on sharpness.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "imaging/camera.h"

namespace relign::imaging {

struct OwnOptimum {
  std::vector<double> true_pose;  // within 0..1
  MseEstimate error;              // there, with another random stream than the search
};

class OptimumFinder {
 public:
  // Everything but settings must outlive the finder; `camera` has the same scene, settings and threads.
  OptimumFinder(const SceneFile& scene, const CaptureSettings& settings, Camera& camera, Parallel& parallel,
                const Reference& reference);
  ~OptimumFinder();

  // A pure function of lens and seed.
  OwnOptimum find(MountedLens& lens, std::uint64_t seed);
  // The coarse search alone.
  std::vector<double> by_rays(MountedLens& lens);

 private:
  class Spots;
  struct SearchCamera;  // a camera and its reference
  SearchCamera search_camera();
  std::vector<double> by_images(MountedLens& lens, std::vector<double> pose, std::uint64_t seed);

  const SceneFile* scene_;
  Transport transport_;
  Camera* camera_;
  Parallel* parallel_;
  const Reference* reference_;
  struct WithoutGhosts;
  std::unique_ptr<WithoutGhosts> without_ghosts_;  // transport ghost: made on first use
  std::unique_ptr<Spots> spots_;
};

}  // namespace relign::imaging
