// Writes animated GIFs in 256 greys. Own code, since OpenCV's image codecs do not write GIF and the format takes a
// hundred lines.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relign::drawing {

class GreyGif {
 public:
  static constexpr int kMaxSide = 65535;
  // Viewers slow down faster animations.
  static constexpr double kMaxFramesPerSecond = 50;

  // Sides of 1 to kMaxSide pixels. Loops for ever.
  GreyGif(int width, int height, double frames_per_second);

  // width * height values, row 0 on top.
  void add(const std::vector<std::uint8_t>& grey);

  // The file. Call once, last.
  std::string take();

 private:
  void number(int value);
  int width_, height_;
  double frames_per_second_;
  int frames_ = 0;
  std::string bytes_;
};

}  // namespace relign::drawing
