// Lines of equal value on a grid.
#pragma once

#include <vector>

#include "drawing/canvas.h"

namespace relign::drawing {

// Where the values, linear between the grid's places, cross `level`: marching squares. `values`: columns x rows, row
// by row; places are counted in steps of the grid, x along the columns, y along the rows.
std::vector<Segment> contour(const std::vector<double>& values, int columns, int rows, double level);

}  // namespace relign::drawing
