#include "drawing/contours.h"

namespace relign::drawing {

std::vector<Segment> contour(const std::vector<double>& values, int columns, int rows, double level) {
  std::vector<Segment> lines;
  const auto value = [&](int column, int row) {
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
  };
  for (int row = 0; row + 1 < rows; ++row)
    for (int column = 0; column + 1 < columns; ++column) {
      // Walks around the cell; a point on each edge that the level crosses.
      const int x[] = {column, column + 1, column + 1, column}, y[] = {row, row, row + 1, row + 1};
      std::vector<Point> crossings;
      for (int k = 0; k < 4; ++k) {
        const int next = (k + 1) % 4;
        const double a = value(x[k], y[k]), b = value(x[next], y[next]);
        if ((a < level) == (b < level)) continue;
        const double share = (level - a) / (b - a);
        crossings.push_back({x[k] + share * (x[next] - x[k]), y[k] + share * (y[next] - y[k])});
      }
      // Four points at a saddle: the value in the middle decides which two are connected.
      if (crossings.size() == 4) {
        const double middle = (value(x[0], y[0]) + value(x[1], y[1]) + value(x[2], y[2]) + value(x[3], y[3])) / 4;
        const bool first_is_low = value(x[0], y[0]) < level;
        if (first_is_low == (middle < level)) {  // corners 0 and 2 are joined; 1 and 3 are cut off
          lines.emplace_back(crossings[0], crossings[1]);
          lines.emplace_back(crossings[2], crossings[3]);
        } else {
          lines.emplace_back(crossings[3], crossings[0]);
          lines.emplace_back(crossings[1], crossings[2]);
        }
      } else if (crossings.size() == 2) {
        lines.emplace_back(crossings[0], crossings[1]);
      }
    }
  return lines;
}

}  // namespace relign::drawing
