// Encodes and decodes image formats in memory: libpng, libjpeg, libtiff and libwebp behind one interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace relign::images {

// Unsigned samples of 8 or 16 bits, row by row from the top, channels interleaved (1: grey, 3: red, green, blue).
struct Samples {
  std::size_t width = 0, height = 0;
  int channels = 1;
  std::vector<std::uint8_t> eight;     // filled for 8 bits
  std::vector<std::uint16_t> sixteen;  // filled for 16 bits
};

// Grey values from 0 (black) to 1 (white), row by row from the top; for float TIFF the values of the file.
struct GreyPixels {
  std::size_t width = 0, height = 0;
  std::vector<float> values;
};

// PNG of 8 or 16 bits.
std::string encode_png(const Samples& samples);

// Lossy WebP of 8-bit grey; quality 0 to 100.
std::string encode_webp(const Samples& grey, float quality);

// Uncompressed TIFF of 32-bit floats.
std::string encode_tiff(std::size_t width, std::size_t height, const float* values);

// Decodes PNG, JPEG, TIFF or WebP, recognised by their first bytes. Colour becomes grey by the weights 0.299, 0.587,
// 0.114 (ITU-R BT.601), alpha is ignored. Throws Error(bad_input) without a file name: for other formats, for damaged
// files, and for images of more than `most_pixels`, which are rejected before they are decoded.
GreyPixels decode_grey(std::string_view bytes, std::size_t most_pixels);

}  // namespace relign::images
