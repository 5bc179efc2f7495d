// Selects tiles for captures of regions.
#include <algorithm>

#include "imaging/pupil_tiles.h"

namespace relign::imaging {

void PupilTiles::select(const std::vector<PixelBox>& boxes) {
  if (boxes.empty() && selects_all_) return;
  selects_all_ = boxes.empty();
  selected_.clear();
  if (selects_all_) {
    is_used_ = used_for_all_;
    for (std::size_t i = 0; i < tiles_.size(); ++i) selected_.push_back(i);
    return;
  }
  std::fill(is_used_.begin(), is_used_.end(), static_cast<char>(0));
  for (const PixelBox& box : boxes)
    for (int row = box.row / grid_.tile_pixels; row <= (box.row + box.rows - 1) / grid_.tile_pixels; ++row)
      for (int column = box.column / grid_.tile_pixels; column <= (box.column + box.columns - 1) / grid_.tile_pixels;
           ++column) {
        const int place = place_in_tiles_[static_cast<std::size_t>(row * grid_.across + column)];
        if (place < 0) continue;
        selected_.push_back(static_cast<std::size_t>(place));
        for (const int across : {column, column + 1})
          for (const int down : {row, row + 1}) is_used_[corner_at(across, down)] = 1;
      }
  std::sort(selected_.begin(), selected_.end());
  selected_.erase(std::unique(selected_.begin(), selected_.end()), selected_.end());
}

}  // namespace relign::imaging
