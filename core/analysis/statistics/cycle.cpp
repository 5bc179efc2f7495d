#include "statistics/cycle.h"

namespace relign::statistics {

Cycle cycle_of(const std::optional<CycleTimes>& stated) {
  return stated ? Cycle{stated->seconds(), stated->computing} : Cycle{};
}

double cycle_seconds(const Cycle& cycle, double align_seconds, double steps, double ms_per_step) {
  return cycle.seconds + align_seconds + (cycle.computing ? steps * ms_per_step / 1000 : 0);
}

}  // namespace relign::statistics
