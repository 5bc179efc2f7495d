#include "report/residual_text.h"

#include <optional>

#include "base/text.h"

namespace relign::report {
namespace {

struct Unit {
  const char* name;
  double size;  // in mm or degrees
  bool angle;
};

constexpr Unit kUnits[] = {{"mm", 1, false},
                           {"um", 1e-3, false},
                           {"\u00b5m", 1e-3, false},
                           {"nm", 1e-6, false},
                           {"m", 1e3, false},
                           {"deg", 1, true},
                           {"arcmin", 1. / 60, true},
                           {"arcsec", 1. / 3600, true},
                           {"rad", 57.29577951308232, true},
                           {"mrad", 0.05729577951308232, true}};

constexpr double kLargestInMicrometres = 0.1, kLargestInArcMinutes = 0.5;  // mm, degrees

std::string length_text(double mm) {
  return mm < kLargestInMicrometres ? significant(1000 * mm, 2) + " \u00b5m" : significant(mm, 2) + " mm";
}

std::string angle_text(double degrees) {
  return degrees < kLargestInArcMinutes ? significant(60 * degrees, 2) + "\u2032" : significant(degrees, 2) + "\u00b0";
}

}  // namespace

Residual residual_of(const std::vector<ResidualAxis>& axes) {
  Residual residual;
  std::optional<double> position, tilt;
  for (const ResidualAxis& axis : axes) {
    if (!std::isfinite(axis.median)) continue;
    residual.details += (residual.details.empty() ? "" : "; ") + axis.name + " " + number_text(axis.median, 3) + " " +
                        axis.unit + " (75 % below " + number_text(axis.q75, 3) + ")";
    for (const Unit& known : kUnits) {
      if (axis.unit != known.name) continue;
      std::optional<double>& worst = known.angle ? tilt : position;
      worst = std::max(worst.value_or(0), known.size * axis.median);
    }
  }
  if (!position && !tilt) return residual;
  if (position) residual.text = length_text(*position) + (tilt ? " / " + angle_text(*tilt) : "");
  if (!position) residual.text = angle_text(*tilt);
  residual.sort = shortest(position ? *position : *tilt);
  return residual;
}

}  // namespace relign::report
