// Animated GIFs in 256 greys, our own: the format is older than any library's interface to it, takes a hundred lines,
// and everything about it is behind this one file. (OpenCV's image codecs write none.)
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relign::drawing {

class GreyGif {
 public:
  static constexpr int kMostSide = 65535;
  // Viewers slow down what is faster.
  static constexpr double kMostFramesPerSecond = 50;

  // Sides of 1 to kMostSide pixels. Plays again and again.
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
