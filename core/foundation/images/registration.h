// Image registration: shift and rotation of an image against a reference image of the same target.
//
// For the centre of a single spot use moments() of measures.h, which needs no reference.
#pragma once

#include "images/measures.h"

namespace relign::images {

struct Registration {
  // Position of the reference's centre in the image, relative to the image's centre: columns to the right, rows down.
  double shift_x_px = 0;
  double shift_y_px = 0;
  double rotation_deg = 0;  // about the centre, clockwise as displayed
};

// The shift and rotation that bring `reference` closest to `image` in the least-squares sense, with free level and
// contrast. Gauss-Newton on an image pyramid, started from zero shift and from the difference of the centroids.
//
// Range: a target on a uniform background is found anywhere in the image; a pattern that fills the image, within half
// of its coarsest period; rotations, within half of the pattern's symmetry (a star of n spokes repeats every 360 / n
// degrees) and about 15 degrees.
//
// NaN where the images do not determine a value: a round spot has no rotation, a straight edge no shift along itself;
// images of different sizes or content (less than a quarter of the variance explained) have neither. The same bits on
// every machine.
Registration registration(const View& image, const View& reference);

}  // namespace relign::images
