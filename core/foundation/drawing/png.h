// Colour pictures as PNG files.
#pragma once

#include <string>

#include "drawing/canvas.h"

namespace relign::drawing {

// 8 bits a colour.
std::string png_bytes(const Raster& picture);

}  // namespace relign::drawing
