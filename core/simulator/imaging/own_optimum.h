// Where a lens as built is best: the pose with the lowest noise-free MSE, what an ideal algorithm could reach.
//
// Coarse: least squares over rays. From places on the sensor the rays of the lens's pupil shall meet the emitter where
// the perfect lens at the nominal pose sees it from there: one Gauss-Newton problem in the pose, smooth and with a wide
// valley. Fine: Levenberg-Marquardt on the image's own residual, with noise-free renders of one seed, so that
// differences of images are differences of poses; every step is checked on the noise-free MSE. Under transport ghost
// the search looks at images without ghosts, which cost a hundredth: a veil does not tell where an image is sharp.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "imaging/camera.h"

namespace relign::imaging {

struct OwnOptimum {
  std::vector<double> true_pose;  // within 0..1
  MseEstimate error;              // there, by a stream of its own: not the one that chose the pose
};

class OptimumFinder {
 public:
  // All but settings outlive the finder; `camera` is of the same scene, settings and threads.
  OptimumFinder(const SceneFile& scene, const CaptureSettings& settings, Camera& camera, Parallel& parallel,
                const Reference& reference);
  ~OptimumFinder();

  // A pure function of lens and seed.
  OwnOptimum find(MountedLens& lens, std::uint64_t seed);
  // The coarse part alone.
  std::vector<double> by_rays(MountedLens& lens);

 private:
  class Spots;
  struct Eye;  // a camera with its reference
  Eye searching_eye();
  std::vector<double> by_images(MountedLens& lens, std::vector<double> pose, std::uint64_t seed);

  const SceneFile* scene_;
  Transport transport_;
  Camera* camera_;
  Parallel* parallel_;
  const Reference* reference_;
  struct Straight;
  std::unique_ptr<Straight> straight_;  // transport ghost: without ghosts, once they are needed
  std::unique_ptr<Spots> spots_;
};

}  // namespace relign::imaging
