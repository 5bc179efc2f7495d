#include "statistics/cycle.h"

namespace relign::statistics {

Cycle cycle_of(const Json& cycle) {
  if (!cycle.is_object()) return {};
  Cycle made{0, false};
  for (const char* station : {"load_s", "dispense_s", "cure_s", "inspect_s"})
    if (const auto found = cycle.find(station); found != cycle.end() && found->is_number())
      made.seconds += found->get<double>();
  if (const auto found = cycle.find("computing"); found != cycle.end() && found->is_boolean())
    made.computing = found->get<bool>();
  return made;
}

double cycle_seconds(const Cycle& cycle, double align_seconds, double steps, double ms_per_step) {
  return cycle.seconds + align_seconds + (cycle.computing ? steps * ms_per_step / 1000 : 0);
}

}  // namespace relign::statistics
