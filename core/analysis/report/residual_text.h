// The residual misalignment as text: the worst position and the worst tilt, in suitable units.
#pragma once

#include <string>

#include "report/page_group.h"

namespace relign::report {

struct Residual {
  std::string text = "-";  // "0.80 \u00b5m / 0.60\u2032"
  std::string details;     // median and upper quartile of every axis, in the scene's units
  std::string sort;        // the position in mm, else the tilt in degrees
};

Residual residual_of(const std::vector<ResidualAxis>& axes);

}  // namespace relign::report
