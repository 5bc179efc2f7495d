// Pictures of a station's trials, which cannot be captured again later.
#include <cstdio>

#include "base/error.h"
#include "base/fault.h"
#include "images/image_file.h"
#include "runner/pictures.h"

namespace relign::runner {
namespace fs = std::filesystem;

std::string frame_name(unsigned step) {
  char name[32];
  std::snprintf(name, sizeof name, "step-%03u.png", step);
  return name;
}

void KeptCaptures::keep(const trials::Step& step, const float* pixels) {
  (step.step == 0 ? first_ : last_) = trials::picture_of(scene_, pixels);
  last_step_ = step.step;
}

void KeptCaptures::write(const fs::path& results, const std::string& trial) const {
  const fs::path folder = results / "pictures" / trial;
  const auto white = static_cast<float>(scene_.image_white);
  try {
    fs::remove_all(folder);
    if (first_.values.empty()) return;
    fs::create_directories(folder);
    images::write_preview(folder / frame_name(0), first_, white);
    if (last_step_ > 0) images::write_preview(folder / frame_name(last_step_), last_, white);
  } catch (const fs::filesystem_error& error) {
    throw Error(ErrorKind::io, "cannot write the pictures: " + fault_text(error));
  }
}

}  // namespace relign::runner
