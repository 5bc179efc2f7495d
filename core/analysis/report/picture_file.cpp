#include "report/picture_file.h"

#include "markup/escape.h"

namespace relign::report {
namespace {

unsigned byte_at(const std::string& bytes, std::size_t at) { return static_cast<unsigned char>(bytes[at]); }

unsigned big_endian(const std::string& bytes, std::size_t at) {
  unsigned value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | byte_at(bytes, i);
  return value;
}

unsigned little_endian(const std::string& bytes, std::size_t at, std::size_t count) {
  unsigned value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | byte_at(bytes, at + i);
  return value;
}

std::optional<Picture> made(const std::string& bytes, const char* type, unsigned width, unsigned height) {
  if (width == 0 || height == 0) return {};
  return Picture{std::string("data:") + type + ";base64," + base64(bytes), width, height};
}

}  // namespace

// Width and height are at fixed offsets in the first chunk of a PNG.
std::optional<Picture> png_picture(const std::string& bytes) {
  static const std::string kSignature("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", 16);
  if (bytes.size() < 33 || bytes.compare(0, kSignature.size(), kSignature) != 0) return {};
  return made(bytes, "image/png", big_endian(bytes, 16), big_endian(bytes, 20));
}

// RFC 9649: "RIFF", size of the rest, "WEBP", then the first chunk, whose name determines where the size is stored.
std::optional<Picture> webp_picture(const std::string& bytes) {
  constexpr std::size_t kShortest = 30;
  constexpr unsigned kFourteenBits = 0x3fff;
  if (bytes.size() < kShortest || bytes.compare(0, 4, "RIFF") != 0 || bytes.compare(8, 4, "WEBP") != 0) return {};
  if (little_endian(bytes, 4, 4) > bytes.size() - 8) return {};  // truncated
  const std::string chunk = bytes.substr(12, 4);
  if (chunk == "VP8 " && bytes.compare(23, 3, "\x9d\x01\x2a") == 0)
    return made(bytes, "image/webp", little_endian(bytes, 26, 2) & kFourteenBits,
                little_endian(bytes, 28, 2) & kFourteenBits);
  if (chunk == "VP8L" && byte_at(bytes, 20) == 0x2f) {
    const unsigned extent = little_endian(bytes, 21, 4);
    return made(bytes, "image/webp", (extent & kFourteenBits) + 1, (extent >> 14 & kFourteenBits) + 1);
  }
  if (chunk == "VP8X")
    return made(bytes, "image/webp", little_endian(bytes, 24, 3) + 1, little_endian(bytes, 27, 3) + 1);
  return {};
}

}  // namespace relign::report
