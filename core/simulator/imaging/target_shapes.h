// Draws white shapes on a black square bitmap, each texel by its covered area. Internal to imaging; used by target.cpp.
// Lengths are fractions of the bitmap's side, x to the right and y downwards from the upper left corner.
#pragma once

#include <vector>

#include "images/image.h"

namespace relign::imaging {

struct Place {
  double x = 0, y = 0;
};

// Corners of a convex polygon, clockwise as displayed.
using Polygon = std::vector<Place>;

Polygon rectangle(double left, double top, double width, double height);
// A square around `centre`, rotated clockwise as displayed.
Polygon turned_square(const Place& centre, double side, double angle_deg);
// A disc as a polygon of 72 corners with the disc's area.
Polygon disc(const Place& centre, double diameter);

// Adds the covered share of each texel. Shapes of one bitmap must not overlap.
void paint(images::Image& bitmap, const Polygon& shape);

}  // namespace relign::imaging
