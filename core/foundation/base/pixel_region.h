// Rectangles of an image's pixels, as plugins select them and records keep them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign {

struct PixelRegion {
  std::uint32_t column = 0, row = 0;  // the first
  std::uint32_t columns = 0, rows = 0;
  bool operator==(const PixelRegion&) const = default;
};
using PixelRegions = std::vector<PixelRegion>;

inline constexpr std::size_t kMaxRegions = 256;

// Four numbers for each: column, row, columns, rows.
std::vector<std::uint32_t> to_numbers(const PixelRegions& regions);
PixelRegions to_regions(const std::uint32_t* numbers, std::size_t count);

// [[column, row, columns, rows], ...] as JSON. Reading throws Error(bad_input).
std::string to_json_text(const PixelRegions& regions);
PixelRegions read_regions(const Json& list);

// What is wrong with the regions of an image: too many, empty or outside it; empty text if nothing is.
std::string mistake_of(const PixelRegions& regions, std::size_t image_width, std::size_t image_height);

// The pixels of all regions, each once: parts of rows, from the top and from the left.
struct PixelSpan {
  std::size_t first = 0;  // in an image of this width, row by row
  std::size_t count = 0;
};
std::vector<PixelSpan> spans_of(const PixelRegions& regions, std::size_t image_width);

}  // namespace relign
