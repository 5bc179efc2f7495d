// Lines of equal value on a grid.
#pragma once

#include <vector>

#include "drawing/canvas.h"

namespace relign::drawing {

// Segments along which the values, interpolated linearly, equal `level`, by marching squares. `values`: columns x rows,
// row by row. Coordinates in grid steps, x along the columns, y along the rows.
std::vector<Segment> contour(const std::vector<double>& values, int columns, int rows, double level);

}  // namespace relign::drawing
