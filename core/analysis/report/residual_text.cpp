#include "report/residual_text.h"

#include <algorithm>
#include <optional>

#include "base/text.h"

namespace relign::report {
namespace {

constexpr double kLargestInMicrometres = 0.1, kLargestInArcMinutes = 0.5;  // mm, degrees

std::string with_unit_behind(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

std::string length_text(double mm) {
  return mm < kLargestInMicrometres ? significant(1000 * mm, 2) + " \u00b5m" : significant(mm, 2) + " mm";
}

std::string angle_text(double degrees) {
  return degrees < kLargestInArcMinutes ? significant(60 * degrees, 2) + "\u2032" : significant(degrees, 2) + "\u00b0";
}

// The median of the worst position and the worst tilt.
void set_position_and_tilt(Residual& residual, const std::vector<ResidualAxis>& axes) {
  std::optional<double> position, tilt;  // mm, degrees
  for (const ResidualAxis& axis : axes) {
    if (!std::isfinite(axis.median)) continue;
    std::optional<double>& worst = axis.unit == "deg" ? tilt : position;
    worst = std::max(worst.value_or(0), axis.median);
  }
  if (!position && !tilt) return;
  if (position) residual.text = length_text(*position) + (tilt ? " / " + angle_text(*tilt) : "");
  if (!position) residual.text = angle_text(*tilt);
  residual.sort = shortest(position ? *position : *tilt);
}

void set_worst_axis(Residual& residual, const std::vector<ResidualAxis>& axes) {
  const ResidualAxis* worst = nullptr;
  const auto share = [](const ResidualAxis& axis) { return axis.median / axis.travel; };
  for (const ResidualAxis& axis : axes)
    if (std::isfinite(share(axis)) && (!worst || share(axis) > share(*worst))) worst = &axis;
  if (!worst) return;
  residual.text = worst->name + " " + with_unit_behind(significant(worst->median, 2), worst->unit) + " (" +
                  significant(100 * share(*worst), 2) + " %)";
  residual.sort = shortest(share(*worst));
}

}  // namespace

bool has_positions_and_tilts(const std::vector<ResidualAxis>& axes) {
  return !axes.empty() && std::all_of(axes.begin(), axes.end(),
                                      [](const ResidualAxis& axis) { return axis.unit == "mm" || axis.unit == "deg"; });
}

Residual residual_of(const std::vector<ResidualAxis>& axes) {
  Residual residual;
  for (const ResidualAxis& axis : axes)
    if (std::isfinite(axis.median))
      residual.details += (residual.details.empty() ? "" : "; ") + axis.name + " " +
                          with_unit_behind(number_text(axis.median, 3), axis.unit) + " (75 % below " +
                          number_text(axis.q75, 3) + ")";
  has_positions_and_tilts(axes) ? set_position_and_tilt(residual, axes) : set_worst_axis(residual, axes);
  return residual;
}

}  // namespace relign::report
