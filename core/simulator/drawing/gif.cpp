#include "drawing/gif.h"

#include <algorithm>
#include <cmath>

namespace relign::drawing {
namespace {

constexpr int kCodes = 4096;  // with at most twelve bits
constexpr int kGreys = 256;
constexpr int kClear = 256, kEnd = 257, kFirst = 258;

// Codes of 9 to 12 bits, lowest bits first, in blocks of at most 255 bytes.
class CodeWriter {
 public:
  explicit CodeWriter(std::string& out) : out_(out) {}
  void write(int code, int bits) {
    waiting_ |= static_cast<std::uint32_t>(code) << count_;
    for (count_ += bits; count_ >= 8; count_ -= 8, waiting_ >>= 8) put(static_cast<char>(waiting_ & 255));
  }
  void finish() {
    if (count_ > 0) put(static_cast<char>(waiting_ & 255));
    if (!block_.empty()) flush();
    out_ += '\0';
  }

 private:
  void put(char byte) {
    block_ += byte;
    if (block_.size() == 255) flush();
  }
  void flush() {
    out_ += static_cast<char>(block_.size());
    out_ += block_;
    block_.clear();
  }
  std::string& out_;
  std::string block_;
  std::uint32_t waiting_ = 0;
  int count_ = 0;
};

// Lempel-Ziv-Welch: each code is a run of earlier pixels; the next free code is that run plus one pixel.
void compress(const std::vector<std::uint8_t>& pixels, std::string& out) {
  CodeWriter writer(out);
  std::vector<std::int16_t> longer(static_cast<std::size_t>(kCodes) * kGreys, -1);  // run, next pixel -> code
  int bits = 9, next = kFirst, run = pixels[0];
  writer.write(kClear, bits);
  for (std::size_t i = 1; i < pixels.size(); ++i) {
    std::int16_t& known = longer[static_cast<std::size_t>(run) * kGreys + pixels[i]];
    if (known >= 0) {
      run = known;
      continue;
    }
    writer.write(run, bits);
    if (next < kCodes) {
      known = static_cast<std::int16_t>(next);
      if (next == 1 << bits) ++bits;
      ++next;
    } else {
      writer.write(kClear, bits);
      std::fill(longer.begin(), longer.end(), std::int16_t{-1});
      bits = 9;
      next = kFirst;
    }
    run = pixels[i];
  }
  writer.write(run, bits);
  // A decoder adds one more run for that code, so that the end code may be one bit wider.
  if (next < kCodes && next == 1 << bits) ++bits;
  writer.write(kEnd, bits);
  writer.finish();
}

}  // namespace

GreyGif::GreyGif(int width, int height, double frames_per_second)
    : width_(width), height_(height), frames_per_second_(std::min(frames_per_second, kMaxFramesPerSecond)) {
  bytes_ = "GIF89a";
  number(width);
  number(height);
  bytes_ += std::string("\xf7\0\0", 3);  // a table of 256 colours for all frames
  for (int grey = 0; grey < kGreys; ++grey) bytes_ += std::string(3, static_cast<char>(grey));
  bytes_ += std::string("\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0", 19);  // loop for ever
}

void GreyGif::number(int value) {
  bytes_ += static_cast<char>(value & 255);
  bytes_ += static_cast<char>(value >> 8);
}

void GreyGif::add(const std::vector<std::uint8_t>& grey) {
  // Delays are in hundredths of a second, rounded so that their sum keeps the rate.
  const auto until = [&](int frames) { return static_cast<int>(std::lround(100.0 * frames / frames_per_second_)); };
  bytes_ += std::string("\x21\xf9\x04\x04", 4);
  number(std::min(until(frames_ + 1) - until(frames_), 65535));
  bytes_ += std::string("\0\0\x2c\0\0\0\0", 7);
  number(width_);
  number(height_);
  bytes_ += std::string("\0\x08", 2);
  compress(grey, bytes_);
  ++frames_;
}

std::string GreyGif::take() {
  bytes_ += '\x3b';
  return std::move(bytes_);
}

}  // namespace relign::drawing
