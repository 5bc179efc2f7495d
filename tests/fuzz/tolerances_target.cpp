// Tolerance files: limits as suppliers quote them.
#include <cmath>

#include "target.h"
#include "tolerances/tolerance_file.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    const tolerances::Tolerances read = tolerances::read_tolerances(JsonSource::from_text(text, "tolerances.json"));
    fuzz::demand(read.sigmas > 0 && std::isfinite(read.sigmas) && std::isfinite(read.movement.cross_talk),
                 "a law that can be drawn from");
    const auto check = [](const std::vector<double>& limits) {
      for (const double limit : limits) fuzz::demand(limit >= 0 && std::isfinite(limit), "a limit");
    };
    const tolerances::Movement& movement = read.movement;
    for (const auto* values : {&movement.backlash, &movement.repeatability, &movement.resolution, &movement.drift})
      check(values->shift_um), check(values->tilt_arcmin);
    check(movement.pivot_um);
    fuzz::demand(movement.drift_seconds >= 0 && std::isfinite(movement.drift_seconds), "a time constant");
    if (read.batch) {
      fuzz::demand(read.batch->size > 0, "modules");
      check(read.batch->cure_shift.shift_um), check(read.batch->cure_shift.tilt_arcmin);
      check(read.batch->inspection.shift_um), check(read.batch->inspection.tilt_arcmin);
    }
    check(read.start.shift_um), check(read.start.tilt_arcmin);
    for (const auto& [element, limits] : read.named) check(limits.shift_um), check(limits.tilt_arcmin);
  });
  return 0;
}
