// Images of scenes as values without padding.
#pragma once

#include <relign/plugin.h>

#include <cstddef>
#include <vector>

namespace relign::plugin_host {

// The pixels, row by row.
inline std::vector<float> packed(const relign_image& image) {
  std::vector<float> values;
  values.reserve(std::size_t{image.width} * image.height);
  for (std::size_t y = 0; y < image.height; ++y) {
    const auto* row = reinterpret_cast<const float*>(reinterpret_cast<const char*>(image.pixels) +
                                                     y * static_cast<std::size_t>(image.row_stride_bytes));
    values.insert(values.end(), row, row + image.width);
  }
  return values;
}

}  // namespace relign::plugin_host
