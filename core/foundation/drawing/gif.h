// Writes animated GIFs in 256 greys, by giflib: OpenCV's image codecs do not write GIF.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

struct GifFileType;

namespace relign::drawing {

class GreyGif {
 public:
  static constexpr int kMaxSide = 65535;
  // Viewers slow down faster animations.
  static constexpr double kMaxFramesPerSecond = 50;

  // Sides of 1 to kMaxSide pixels. Loops for ever.
  GreyGif(int width, int height, double frames_per_second);
  GreyGif(const GreyGif&) = delete;

  // width * height values, row 0 on top.
  void add(std::vector<std::uint8_t> grey);

  // The file. Call once, last.
  std::string take();

 private:
  int width_, height_;
  double frames_per_second_;
  int frames_ = 0;
  std::string bytes_;
  struct Close {
    void operator()(GifFileType* file) const;
  };
  std::unique_ptr<GifFileType, Close> file_;
};

}  // namespace relign::drawing
