#include "base/pixel_region.h"

#include <algorithm>

#include "base/error.h"

namespace relign {
namespace {

constexpr std::size_t kNumbers = 4;  // of a region

std::string text_of(const PixelRegion& region) {
  return '[' + std::to_string(region.column) + ',' + std::to_string(region.row) + ',' + std::to_string(region.columns) +
         ',' + std::to_string(region.rows) + ']';
}

}  // namespace

std::vector<std::uint32_t> to_numbers(const PixelRegions& regions) {
  std::vector<std::uint32_t> numbers;
  for (const PixelRegion& region : regions)
    numbers.insert(numbers.end(), {region.column, region.row, region.columns, region.rows});
  return numbers;
}

PixelRegions to_regions(const std::uint32_t* numbers, std::size_t count) {
  PixelRegions regions(count);
  for (PixelRegion& region : regions) {
    region = {numbers[0], numbers[1], numbers[2], numbers[3]};
    numbers += kNumbers;
  }
  return regions;
}

std::string to_json_text(const PixelRegions& regions) {
  std::string list;
  for (const PixelRegion& region : regions) list += (list.empty() ? "" : ",") + text_of(region);
  return '[' + list + ']';
}

PixelRegions read_regions(const Json& list) {
  PixelRegions regions;
  const auto is_number = [](const Json& value) {
    return value.is_number_unsigned() && value.get<std::uint64_t>() <= UINT32_MAX;
  };
  const auto is_region = [&](const Json& item) {
    return item.is_array() && item.size() == kNumbers && std::all_of(item.begin(), item.end(), is_number);
  };
  if (!list.is_array() || !std::all_of(list.begin(), list.end(), is_region))
    throw Error(ErrorKind::bad_input,
                "expected a list of regions, each [column, row, columns, rows] as non-negative "
                "integers, found " +
                    list.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 60));
  for (const Json& item : list)
    regions.push_back({item[0].get<std::uint32_t>(), item[1].get<std::uint32_t>(), item[2].get<std::uint32_t>(),
                       item[3].get<std::uint32_t>()});
  return regions;
}

std::string mistake_of(const PixelRegions& regions, std::size_t image_width, std::size_t image_height) {
  if (regions.size() > kMaxRegions)
    return "found " + std::to_string(regions.size()) + " regions; expected at most " + std::to_string(kMaxRegions);
  for (const PixelRegion& region : regions) {
    const std::string found = "found the region " + text_of(region) + " (column, row, columns, rows); expected ";
    if (region.columns == 0 || region.rows == 0) return found + "at least one pixel";
    if (std::uint64_t{region.column} + region.columns > image_width ||
        std::uint64_t{region.row} + region.rows > image_height)
      return found + "pixels of the image, which has " + std::to_string(image_width) + " columns and " +
             std::to_string(image_height) + " rows";
  }
  return "";
}

std::vector<PixelSpan> spans_of(const PixelRegions& regions, std::size_t image_width) {
  PixelRegions sorted = regions;
  std::sort(sorted.begin(), sorted.end(),
            [](const PixelRegion& one, const PixelRegion& other) { return one.column < other.column; });
  std::size_t top = SIZE_MAX, bottom = 0;
  for (const PixelRegion& region : sorted) {
    top = std::min<std::size_t>(top, region.row);
    bottom = std::max<std::size_t>(bottom, std::size_t{region.row} + region.rows);
  }
  std::vector<PixelSpan> spans;
  for (std::size_t row = top; row < bottom; ++row) {
    std::size_t end = 0;  // of the pixels of this row so far
    for (const PixelRegion& region : sorted) {
      if (row < region.row || row >= std::size_t{region.row} + region.rows) continue;
      const std::size_t from = std::max<std::size_t>(end, region.column);
      const std::size_t to = std::size_t{region.column} + region.columns;
      if (to <= from) continue;
      if (from == end && end > 0)
        spans.back().count += to - from;
      else
        spans.push_back({row * image_width + from, to - from});
      end = to;
    }
  }
  return spans;
}

}  // namespace relign
