// Tolerance files: limits as suppliers quote them.
#include <cmath>

#include "target.h"
#include "tolerances/tolerance_file.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    const tolerances::Tolerances read = tolerances::read_tolerances(JsonSource::from_text(text, "tolerances.json"));
    fuzz::demand(read.sigmas > 0 && std::isfinite(read.sigmas) && std::isfinite(read.cross_talk),
                 "a law that can be drawn from");
    const auto check = [](const std::vector<double>& limits) {
      for (const double limit : limits) fuzz::demand(limit >= 0 && std::isfinite(limit), "a limit");
    };
    check(read.start.shift_um), check(read.start.tilt_arcmin);
    for (const auto& [element, limits] : read.named) check(limits.shift_um), check(limits.tilt_arcmin);
  });
  return 0;
}
