// Drawing of the error over a scene's poses, plane by plane, for `scene landscape`.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "drawing/canvas.h"

namespace relign::drawing {

struct LandscapeAxis {
  std::string name, unit;
  double lower = 0, upper = 0;  // physical values at shares 0 and 1
  double nominal = 0.5;         // share
};

// The values over two axes; all other axes are at the pose where the planes intersect.
struct LandscapePlane {
  std::size_t across = 0, up = 1;  // numbers of axes
  std::vector<double> values;      // points x points, row by row, from the axes' lower ends
  // Derivatives of the values by the shares of `across` (x) and `up` (y), by place. Drawn as arrows against them.
  std::map<std::size_t, Point> slopes;
  std::size_t lowest() const;  // the place of the smallest value
};

struct Landscape {
  std::string title, subtitle;
  std::string measure;  // "RMSE", "insertion loss in dB"
  // Colours and contours are logarithmic from this value on; 0: linear.
  double logarithmic_from = 0;
  int points = 0;  // on each axis, from lower to upper; at least 2
  std::vector<LandscapeAxis> axes;
  std::vector<LandscapePlane> planes;  // in the order of plane_axes
};

// Every pair of axes, in the order of a drawing's rows: (0, 1), (0, 2), (1, 2), ...
std::vector<std::pair<std::size_t, std::size_t>> plane_axes(std::size_t axes);

// Whether an arrow at this place of a plane is in the grid of arrows: at most 9 x 9, and none on the border.
bool has_arrow(int points, std::size_t place);

// Positions of the panels: a triangle, one row for each axis but the first. The legend is in the free corner.
struct LandscapeLayout {
  explicit LandscapeLayout(std::size_t axes);
  Rectangle panel(std::size_t across, std::size_t up) const;
  double width = 0, height = 0;
  Rectangle legend;
};

std::string landscape_svg(const Landscape& landscape);
Raster landscape_raster(const Landscape& landscape, double pixels_per_unit);

// A self-contained HTML page: the drawing, with a tooltip of value and pose.
std::string landscape_page(const Landscape& landscape);

// CSV, one line per value: axes, physical values, shares, value; then, if a plane has slopes, both or nothing.
std::string landscape_table(const Landscape& landscape);

}  // namespace relign::drawing
