// What the decoders of all image formats share.
#pragma once

#include <string>

#include "base/error.h"
#include "images/codecs.h"

namespace relign::images {

[[noreturn]] inline void damaged(const std::string& reason) {
  throw Error(ErrorKind::bad_input, "the image cannot be decoded: " + reason);
}

inline bool is_too_large(std::size_t width, std::size_t height, std::size_t most) {
  return width == 0 || height == 0 || height > most / width;
}

// Throws for images without pixels and for those of more than `most`.
inline void refuse_large(std::size_t width, std::size_t height, std::size_t most) {
  if (width == 0 || height == 0) damaged("it has no pixels");
  if (is_too_large(width, height, most))
    throw Error(ErrorKind::bad_input, "the image has " + std::to_string(width) + " x " + std::to_string(height) +
                                          " pixels; allowed: at most " + std::to_string(most));
}

// Grey of a colour, ITU-R BT.601.
inline float luma(float red, float green, float blue) { return 0.299F * red + 0.587F * green + 0.114F * blue; }

// Through libtiff: grey or colour of 8, 16 (unsigned) or 32 bits (float). Throws as decode_grey does.
GreyPixels decode_tiff(std::string_view bytes, std::size_t most_pixels);

}  // namespace relign::images
