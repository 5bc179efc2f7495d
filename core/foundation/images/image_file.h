// Reads and writes image files: PNG, JPEG, TIFF and WebP through their libraries, NumPy .npy (float32, height x width)
// directly.
#pragma once

#include <filesystem>
#include <vector>

#include "images/image.h"

namespace relign::images {

// Reads PNG, JPEG, TIFF or WebP as grey values from 0 (black) to 1 (white); colour is converted to grey.
// Throws Error: io for an unreadable file; bad_input for a file that is not an image or has more than
// 100 million pixels.
Image read_image(const std::filesystem::path& path);

// Writes the format of the file's extension: .png (16 bit, `white` maps to full scale, clipped), .tiff (float32)
// or .npy (float32). Atomic (temporary file and rename). Throws Error: bad_input for another extension, otherwise io.
void write_image(const std::filesystem::path& path, const Image& image, float white = 1.0F);

// 8-bit PNG, `white` at full scale, for pages and galleries.
void write_preview(const std::filesystem::path& path, const Image& image, float white);

// A film strip for pages: the images side by side, each scaled to fit a square of `tile` pixels and padded with black.
// 8-bit WebP, lossy.
void write_film(const std::filesystem::path& path, const std::vector<Image>& images, unsigned tile, float white);

}  // namespace relign::images
