#include "imaging/target.h"

#include <algorithm>
#include <vector>

#include "base/error.h"
#include "optics/elementary.h"
#include "pixels/image_file.h"

namespace relign::imaging {

pixels::Image siemens_star(int texels, int sectors) {
  // A place is white if it lies between the two edges of a white sector: left of the first and right
  // of the second, by cross products (sectors are narrower than a half turn).
  std::vector<optics::SineCosine> edges;
  for (int k = 0; k <= 2 * sectors; ++k) edges.push_back(optics::sine_cosine_of_degrees(180.0 * k / sectors));
  const auto size = static_cast<std::size_t>(texels);
  pixels::Image star(size, size);
  for (int row = 0; row < texels; ++row)
    for (int column = 0; column < texels; ++column) {
      const double x = column + 0.5 - 0.5 * texels;
      const double y = 0.5 * texels - (row + 0.5);
      for (int k = 0; k < 2 * sectors; k += 2) {
        const optics::SineCosine &from = edges[static_cast<std::size_t>(k)],
                                 &to = edges[static_cast<std::size_t>(k + 1)];
        if (from.cosine * y - from.sine * x >= 0 && x * to.sine - y * to.cosine > 0) {
          star.at(static_cast<std::size_t>(column), static_cast<std::size_t>(row)) = 1;
          break;
        }
      }
    }
  return star;
}

pixels::Image target_from_file(const std::filesystem::path& file) {
  constexpr std::size_t kMostTexels = 8192;
  const pixels::Image image = pixels::read_image(file);
  const std::size_t side = std::max({image.width, image.height, std::size_t{2}});
  if (side > kMostTexels)
    throw Error(ErrorKind::bad_input, file.string() + ": the target is " + std::to_string(image.width) + " x " +
                                          std::to_string(image.height) + "; at most " + std::to_string(kMostTexels) +
                                          " texels a side are used, scale it down");
  pixels::Image square(side, side);
  const std::size_t left = (side - image.width) / 2, top = (side - image.height) / 2;
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) square.at(left + x, top + y) = std::clamp(image.at(x, y), 0.0F, 1.0F);
  return square;
}

}  // namespace relign::imaging
