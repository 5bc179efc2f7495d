// Image files: PNG, JPEG, TIFF and WebP through their own libraries; NumPy's .npy (float32, height x width) by our own.
#pragma once

#include <filesystem>
#include <vector>

#include "images/image.h"

namespace relign::images {

// Reads PNG, JPEG, TIFF or WebP as grey, 0 (black) to 1 (white). Colour is weighted to grey.
// Throws Error(io) for an unreadable file, bad_input for one that is no image or too large
// (more than 100 million pixels).
Image read_image(const std::filesystem::path& path);

// Writes by the file's ending: .png (16 bit, `white` maps to full scale, clipped), .tiff (float32),
// .npy (float32). Temporary file and rename. Throws Error(bad_input) for another ending, io otherwise.
void write_image(const std::filesystem::path& path, const Image& image, float white = 1.0F);

// 8-bit PNG for pages and galleries.
void write_preview(const std::filesystem::path& path, const Image& image, float white);

// Images side by side in one small picture for pages: each shrunk or enlarged into a square of `tile` pixels, black
// around what is not square. 8-bit WebP, lossy.
void write_film(const std::filesystem::path& path, const std::vector<Image>& images, unsigned tile, float white);

}  // namespace relign::images
