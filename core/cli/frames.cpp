#include "cli/frames.h"

#include <cstdio>

#include "images/image_file.h"

namespace relign::cli {

void save_frame(const std::filesystem::path& folder, unsigned step, const trials::SceneFacts& facts,
                const float* pixels) {
  char name[32];
  std::snprintf(name, sizeof name, "step-%03u.png", step);
  images::write_image(folder / name, trials::picture_of(facts, pixels), static_cast<float>(facts.image_white));
}

}  // namespace relign::cli
