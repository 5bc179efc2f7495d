// Headers of picture files. A results folder is untrusted input: only PNG and WebP files with a valid signature and
// size are embedded into a page.
#pragma once

#include <optional>
#include <string>

namespace relign::report {

struct Picture {
  std::string data_uri;
  unsigned width = 0, height = 0;
};

// nullopt if the bytes are not such a picture, or its size is 0.
std::optional<Picture> png_picture(const std::string& bytes);
std::optional<Picture> webp_picture(const std::string& bytes);  // lossy, lossless or extended

}  // namespace relign::report
