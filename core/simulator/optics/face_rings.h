// What a polynomial face keeps within rings of equal width about its axis, out to its clear radius: violent polynomials
// bend much at the rim and little elsewhere. Without includes, because the block kernels read it.
#pragma once

namespace relign::optics {

constexpr int kRings = 32;

struct FaceRings {
  double lowest[kRings], highest[kRings];  // sag, mm
  double most_bent[kRings];                // second derivative of the sag in any direction, 1/mm
  // Of all straight lines from a place of the ring up to a higher place of the face, the slope of the steepest, rounded
  // upwards: a ray that falls towards -z more steeply cannot have met the face before. Over places farther from the
  // axis alone, which is enough for a ray that comes nearer to the axis; and over those that a ray can have passed
  // which goes away from it.
  float rise_outside[kRings], rise_anywhere[kRings];
};

}  // namespace relign::optics
