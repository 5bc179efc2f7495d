// The pixels of a sensor and their places. NVRTC compiles this header.
#pragma once

#include "optics/motion.h"

namespace relign::imaging {

// Pixels [column, column + columns) x [row, row + rows).
struct PixelBox {
  int column = 0, row = 0;
  int columns = 0, rows = 0;
};

inline bool holds(const PixelBox& box, int column, int row) {
  return column >= box.column && column < box.column + box.columns && row >= box.row && row < box.row + box.rows;
}

// width x height square pixels. Row 0 is at the largest world y.
struct PixelGrid {
  double z_mm = 0;  // world
  double pitch_mm = 0;
  int width = 0, height = 0;       // pixels
  double left_mm = 0, top_mm = 0;  // world x and y of the corner where pixel (0, 0) begins
  double bow_per_mm = 0;           // of a warped sensor; its tiles are flat, each at the z of its middle

  double z_at(double x_mm, double y_mm) const { return z_mm + bow_per_mm * (x_mm * x_mm + y_mm * y_mm); }
  // World position at `column`, `row`, counted in pixels from that corner.
  optics::Vec3 place(double column, double row) const {
    const double x = left_mm + column * pitch_mm, y = top_mm - row * pitch_mm;
    return {x, y, z_at(x, y)};
  }
};

// Of a box, in the world.
inline optics::Vec3 middle_of(const PixelGrid& sensor, const PixelBox& box) {
  return sensor.place(box.column + 0.5 * box.columns, box.row + 0.5 * box.rows);
}

}  // namespace relign::imaging
