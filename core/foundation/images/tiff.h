// TIFF in memory, through libtiff.
#pragma once

#include "images/codecs.h"

namespace relign::images {

// Grey or colour of 8, 16 (unsigned) or 32 bits (float). Throws as decode_grey does.
GreyPixels decode_tiff(std::string_view bytes, std::size_t most_pixels);

}  // namespace relign::images
