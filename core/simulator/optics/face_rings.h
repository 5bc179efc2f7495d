// Bounds of a polynomial face in rings of equal width around its axis: steep aspheres bend strongly at the rim and
// little elsewhere. No includes, because the block kernels read this header.
#pragma once

namespace relign::optics {

constexpr int kRings = 32;

struct FaceRings {
  double lowest[kRings], highest[kRings];  // sag, mm
  double most_bent[kRings];                // second derivative of the sag in any direction, 1/mm
  // Slope of the steepest straight line from a point of the ring to a higher point of the face, rounded up: a ray that
  // descends towards -z more steeply cannot have hit the face before. rise_outside: over points farther from the axis,
  // enough for a ray that approaches the axis. rise_anywhere: over all points that a ray receding from the axis can
  // have passed.
  float rise_outside[kRings], rise_anywhere[kRings];
};

}  // namespace relign::optics
