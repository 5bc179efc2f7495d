// A grey image in memory: float32, row-major, no padding, row 0 at the top.
#pragma once

#include <cstddef>
#include <vector>

namespace relign::images {

struct Image {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<float> values;  // width * height

  Image() = default;
  Image(std::size_t w, std::size_t h, float value = 0) : width(w), height(h), values(w * h, value) {}
  float& at(std::size_t x, std::size_t y) { return values[y * width + x]; }
  float at(std::size_t x, std::size_t y) const { return values[y * width + x]; }
};

}  // namespace relign::images
