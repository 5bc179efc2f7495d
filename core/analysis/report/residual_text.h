// The residual misalignment as text. On stages with millimetres and degrees alone: the worst position and the worst
// tilt. With any other unit: the axis that is worst as a share of its travel.
#pragma once

#include <string>

#include "report/page_group.h"

namespace relign::report {

struct Residual {
  std::string text = "-";  // "0.80 \u00b5m / 0.60\u2032", or "roll 0.042 mrad (1.4 %)"
  std::string details;     // median and upper quartile of every axis, in the scene's units
  std::string sort;        // the position in mm, else the tilt in degrees; or the share of the travel
};

// Whether the axes, of which there is one at least, are those of a stage with millimetres and degrees alone.
bool has_positions_and_tilts(const std::vector<ResidualAxis>& axes);

Residual residual_of(const std::vector<ResidualAxis>& axes);

}  // namespace relign::report
