// Animated GIFs, decoded by a small reader written from the format's specification, independent of our writer.
#include "drawing/gif.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace relign::drawing {
namespace {

struct Frame {
  int delay = 0;
  std::vector<std::uint8_t> grey;
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  std::vector<Frame> frames() {
    EXPECT_EQ(bytes_.substr(0, 6), "GIF89a");
    at_ = 6;
    width = word();
    height = word();
    EXPECT_EQ(byte(), 0xf7);
    at_ += 2;
    for (int grey = 0; grey < 256; ++grey)
      for (int part = 0; part < 3; ++part) EXPECT_EQ(byte(), grey);
    std::vector<Frame> frames;
    Frame frame;
    for (int mark = byte(); mark != 0x3b; mark = byte()) {
      if (mark == 0x21 && byte() == 0xf9) {
        EXPECT_EQ(byte(), 4);
        byte();
        frame.delay = word();
        at_ += 2;
      } else if (mark == 0x21) {
        blocks();
      } else {
        EXPECT_EQ(mark, 0x2c);
        at_ += 4;
        EXPECT_EQ(word(), width);
        EXPECT_EQ(word(), height);
        EXPECT_EQ(byte(), 0);
        EXPECT_EQ(byte(), 8);
        frame.grey = unpacked(blocks());
        frames.push_back(frame);
      }
      if (at_ >= bytes_.size()) return {};
    }
    EXPECT_EQ(at_, bytes_.size());
    return frames;
  }
  int width = 0, height = 0;

 private:
  int byte() { return static_cast<unsigned char>(bytes_.at(at_++)); }
  int word() {
    const int low = byte();
    return low + 256 * byte();
  }
  std::string blocks() {
    std::string content;
    for (int length = byte(); length != 0; length = byte()) {
      content += bytes_.substr(at_, static_cast<std::size_t>(length));
      at_ += static_cast<std::size_t>(length);
    }
    return content;
  }
  static std::vector<std::uint8_t> unpacked(const std::string& packed) {
    std::vector<std::string> runs;
    std::string out, last;
    const auto reset = [&] {
      runs.clear();
      for (int grey = 0; grey < 256; ++grey) runs.emplace_back(1, static_cast<char>(grey));
      runs.resize(258);
      last.clear();
    };
    reset();
    std::size_t bit = 0;
    while (true) {
      int bits = 9;
      // One run is added for each code but the first: the width grows when the next number no longer fits.
      while (bits < 12 && runs.size() + (last.empty() ? 0 : 1) > (std::size_t{1} << bits)) ++bits;
      int code = 0;
      for (int k = 0; k < bits; ++k, ++bit)
        code |= ((static_cast<unsigned char>(packed.at(bit / 8)) >> (bit % 8)) & 1) << k;
      if (code == 257) break;
      if (code == 256) {
        reset();
        continue;
      }
      const auto number = static_cast<std::size_t>(code);
      const std::string run = number < runs.size() ? runs[number] : last + last[0];
      if (!last.empty() && runs.size() < 4096) runs.push_back(last + run[0]);
      out += run;
      last = run;
    }
    return {out.begin(), out.end()};
  }
  std::string bytes_;
  std::size_t at_ = 0;
};

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
    Reader reader(gif.take());
    const std::vector<Frame> frames = reader.frames();
    EXPECT_EQ(reader.width, width);
    EXPECT_EQ(reader.height, height);
    ASSERT_EQ(frames.size(), written.size());
    for (std::size_t k = 0; k < frames.size(); ++k) EXPECT_TRUE(frames[k].grey == written[k]) << width << " " << k;
  }
}

// Every length around the places where codes grow wider: frames of noise hold one code a pixel at first.
TEST(GreyGif, CodeWidthGrowsWhereDecodersExpectIt) {
  std::mt19937 random(5);
  for (int length = 240; length < 300; ++length) {
    std::vector<std::uint8_t> grey;
    for (int i = 0; i < length; ++i) grey.push_back(static_cast<std::uint8_t>(random()));
    GreyGif gif(length, 1, 10);
    gif.add(grey);
    const std::vector<Frame> frames = Reader(gif.take()).frames();
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_TRUE(frames[0].grey == grey) << length;
  }
}

TEST(GreyGif, DelaysKeepTheFrameRate) {
  GreyGif gif(1, 1, 30);
  for (int k = 0; k < 30; ++k) gif.add({0});
  int sum = 0;
  for (const Frame& frame : Reader(gif.take()).frames()) sum += frame.delay;
  EXPECT_EQ(sum, 100);  // hundredths of a second
}

}  // namespace
}  // namespace relign::drawing
