// Animated GIFs, decoded by giflib.
#include "drawing/gif.h"

#include <gif_lib.h>
#include <gtest/gtest.h>

#include <array>
#include <random>

namespace relign::drawing {
namespace {

struct Frame {
  int delay = 0;
  std::vector<std::uint8_t> grey;
};

std::vector<Frame> frames_of(std::string bytes, int width, int height) {
  EXPECT_EQ(bytes.substr(0, 6), "GIF89a");
  EXPECT_NE(bytes.find("NETSCAPE2.0"), std::string::npos) << "loops";
  const auto read = [](GifFileType* file, GifByteType* into, int count) {
    auto& rest = *static_cast<std::string*>(file->UserData);
    const std::size_t copied = rest.copy(reinterpret_cast<char*>(into), static_cast<std::size_t>(count));
    rest.erase(0, copied);
    return static_cast<int>(copied);
  };
  GifFileType* const file = DGifOpen(&bytes, read, nullptr);
  EXPECT_EQ(DGifSlurp(file), GIF_OK);
  EXPECT_EQ(file->SWidth, width);
  EXPECT_EQ(file->SHeight, height);
  std::vector<Frame> frames;
  for (int i = 0; i < file->ImageCount; ++i) {
    const SavedImage& image = file->SavedImages[i];
    EXPECT_EQ(image.ImageDesc.Width, width);
    EXPECT_EQ(image.ImageDesc.Height, height);
    GraphicsControlBlock control;
    EXPECT_EQ(DGifSavedExtensionToGCB(file, i, &control), GIF_OK);
    Frame frame{control.DelayTime, {}};
    for (int at = 0; at < width * height; ++at)
      frame.grey.push_back(file->SColorMap->Colors[image.RasterBits[at]].Green);
    frames.push_back(frame);
  }
  DGifCloseFile(file, nullptr);
  return frames;
}

TEST(GreyGif, RoundTripsThroughDecoder) {
  std::mt19937 random(3);
  // Flat, smooth, noisy (the table of runs overflows many times) and short frames.
  for (const auto& [width, height] : std::vector<std::array<int, 2>>{{1, 1}, {2, 1}, {15, 16}, {200, 200}, {257, 3}}) {
    GreyGif gif(width, height, 12);
    std::vector<std::vector<std::uint8_t>> written;
    for (int kind = 0; kind < 4; ++kind) {
      std::vector<std::uint8_t> grey(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      for (std::size_t i = 0; i < grey.size(); ++i)
        grey[i] = kind == 0   ? 255
                  : kind == 1 ? static_cast<std::uint8_t>(i / 7)
                  : kind == 2 ? static_cast<std::uint8_t>(random())
                              : static_cast<std::uint8_t>(random() % 3 * 100);
      written.push_back(grey);
      gif.add(grey);
    }
    const std::vector<Frame> frames = frames_of(gif.take(), width, height);
    ASSERT_EQ(frames.size(), written.size());
    for (std::size_t k = 0; k < frames.size(); ++k) EXPECT_TRUE(frames[k].grey == written[k]) << width << " " << k;
  }
}

TEST(GreyGif, DelaysKeepTheFrameRate) {
  GreyGif gif(1, 1, 30);
  for (int k = 0; k < 30; ++k) gif.add({0});
  int sum = 0;
  for (const Frame& frame : frames_of(gif.take(), 1, 1)) sum += frame.delay;
  EXPECT_EQ(sum, 100);  // hundredths of a second
}

}  // namespace
}  // namespace relign::drawing
