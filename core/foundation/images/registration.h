// How an image lies against another one of the same target: its shift and its rotation.
//
// When to use something else: the centre of a spot alone is moments() of measures.h, and needs no second image.
#pragma once

#include "images/measures.h"

namespace relign::images {

struct Registration {
  // Where the middle of the reference lies in the image, from the image's own middle: columns to the right, rows down.
  double shift_x_px = 0;
  double shift_y_px = 0;
  double rotation_deg = 0;  // about the middle, clockwise as displayed
};

// The shift and rotation that bring `reference` closest to `image` by least squares, level and contrast free. Searched
// coarse to fine, from no shift and from the difference of both centroids: a target on an even ground is found wherever
// it lies, a pattern that fills the image within half of its coarsest period; rotations within half of the pattern's
// own symmetry (a star of n spokes looks alike every 360 / n degrees), at most some 15 degrees. NaN where the images do
// not tell: a round spot has no rotation, a straight edge no shift along itself, and images of different sizes or
// things (less than a quarter of the variance in common) have nothing. The same bits on every machine.
Registration registration(const View& image, const View& reference);

}  // namespace relign::images
