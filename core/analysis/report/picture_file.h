// What a picture file says of itself. Files in a results folder may come from a stranger: only PNG and WebP whose
// signature and size stand where the formats want them are embedded into a page.
#pragma once

#include <optional>
#include <string>

namespace relign::report {

struct Picture {
  std::string data_uri;
  unsigned width = 0, height = 0;
};

// None where the bytes are no such picture, or one without an extent.
std::optional<Picture> png_picture(const std::string& bytes);
std::optional<Picture> webp_picture(const std::string& bytes);  // lossy, lossless or extended

}  // namespace relign::report
