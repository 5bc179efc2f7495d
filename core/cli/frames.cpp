#include "cli/frames.h"

#include <algorithm>
#include <cstdio>

#include "images/image_file.h"

namespace relign::cli {

void save_frame(const std::filesystem::path& folder, unsigned step, const trials::SceneFacts& facts,
                const float* pixels) {
  char name[32];
  std::snprintf(name, sizeof name, "step-%03u.png", step);
  images::Image image(facts.image_width, facts.image_height);
  std::copy(pixels, pixels + image.values.size(), image.values.begin());
  images::write_image(folder / name, trials::picture_of(facts, std::move(image)),
                      static_cast<float>(facts.image_white));
}

}  // namespace relign::cli
