// Image files: round trips, and errors for files that cannot be read or written.
#include "images/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/files.h"
#include "images/codecs.h"

namespace relign::images {
namespace {

namespace fs = std::filesystem;
using testing::FloatNear;
using testing::HasSubstr;
using testing::Pointwise;

class ImageFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relign-image-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path file(const std::string& name, const std::string& content) {
    write_file_atomically(folder_ / name, content);
    return folder_ / name;
  }
  std::string refusal(const fs::path& path, ErrorKind kind) {
    try {
      read_image(path);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind);
      EXPECT_THAT(error.what(), HasSubstr(path.filename().string()));
      return error.what();
    }
    return "no error";
  }
  fs::path folder_;
};

// 3 x 2 pixels of different values.
Image sample() {
  Image image(3, 2);
  image.values = {0.0F, 0.25F, 0.5F, 0.75F, 1.0F, 0.125F};
  return image;
}

TEST(Image, IsRowMajorWithTopRowFirst) {
  Image image = sample();
  EXPECT_EQ(image.at(2, 0), 0.5F);
  EXPECT_EQ(image.at(0, 1), 0.75F);
  image.at(1, 1) = 7;
  EXPECT_EQ(image.values[4], 7);
  EXPECT_EQ(Image(2, 2, 0.5F).values, std::vector<float>(4, 0.5F));
}

TEST_F(ImageFileTest, PngKeepsSixteenBits) {
  write_image(folder_ / "a.png", sample());
  const Image read = read_image(folder_ / "a.png");
  ASSERT_EQ(read.width, 3u);
  ASSERT_EQ(read.height, 2u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(read.values[i], sample().values[i], 0.5 / 65535 + 1e-7);
}

TEST_F(ImageFileTest, PngMapsWhiteToFullScaleAndClips) {
  Image image(4, 1);
  image.values = {-1, 0.0575F, 0.115F, 5};
  write_image(folder_ / "a.PNG", image, 0.115F);
  const Image read = read_image(folder_ / "a.PNG");
  EXPECT_EQ(read.values[0], 0);
  EXPECT_NEAR(read.values[1], 0.5, 1.0 / 65535);
  EXPECT_EQ(read.values[2], 1);
  EXPECT_EQ(read.values[3], 1);
}

TEST_F(ImageFileTest, TiffKeepsFloats) {
  Image image = sample();
  image.values[1] = 1.0F / 3;
  image.values[2] = -2.5e-7F;
  image.values[5] = 42;
  for (const char* name : {"a.tiff", "a.tif"}) {
    write_image(folder_ / name, image);
    const Image read = read_image(folder_ / name);
    ASSERT_EQ(read.width, 3u);
    EXPECT_EQ(read.values, image.values);
  }
}

TEST_F(ImageFileTest, NpyMatchesNumpyFormat) {
  write_image(folder_ / "a.npy", sample());
  const std::string bytes = read_file(folder_ / "a.npy");
  // The format's own description: magic, version 1.0, length of the header, a Python dictionary padded
  // with blanks to a multiple of 64 and ended by a newline, then the rows.
  ASSERT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t length = static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  EXPECT_EQ((10 + length) % 64, 0u);
  ASSERT_EQ(bytes.size(), 10 + length + 6 * sizeof(float));
  const std::string header = bytes.substr(10, length);
  EXPECT_EQ(header.back(), '\n');
  EXPECT_EQ(header.substr(0, header.find_last_not_of(" \n") + 1),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }");
  float values[6];
  std::memcpy(values, bytes.data() + 10 + length, sizeof values);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(values[i], sample().values[i]);
}

TEST_F(ImageFileTest, WritesNpyOfAnEmptyImage) {
  write_image(folder_ / "a.npy", Image(0, 0));
  const std::string bytes = read_file(folder_ / "a.npy");
  EXPECT_THAT(bytes, HasSubstr("(0, 0)"));
  EXPECT_EQ(bytes.size() % 64, 0u);
}

TEST_F(ImageFileTest, PreviewIsEightBitPng) {
  Image image(2, 1);
  image.values = {0.0575F, 0.2F};
  write_preview(folder_ / "p.png", image, 0.115F);
  const std::string bytes = read_file(folder_ / "p.png");
  ASSERT_GT(bytes.size(), 26u);
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  EXPECT_EQ(bytes[24], 8) << "bits a sample";
  EXPECT_EQ(bytes[25], 0) << "grey";
  const Image read = read_image(folder_ / "p.png");
  EXPECT_NEAR(read.values[0], 0.5, 1.0 / 255);
  EXPECT_EQ(read.values[1], 1);
}

TEST_F(ImageFileTest, FilmStripHasImagesSideBySide) {
  Image white(40, 20), grey(4, 4);
  std::fill(white.values.begin(), white.values.end(), 2.0F);
  std::fill(grey.values.begin(), grey.values.end(), 0.5F);
  write_film(folder_ / "f.webp", {white, grey}, 20, 1);
  EXPECT_EQ(read_file(folder_ / "f.webp").substr(8, 4), "WEBP");
  const Image read = read_image(folder_ / "f.webp");
  ASSERT_EQ(read.width, 40U);
  ASSERT_EQ(read.height, 20U);
  const auto at = [&](std::size_t x, std::size_t y) { return read.values[y * read.width + x]; };
  EXPECT_NEAR(at(10, 10), 1, 0.03) << "twice as wide as high: shrunk to the middle";
  EXPECT_NEAR(at(10, 2), 0, 0.06);
  EXPECT_NEAR(at(30, 10), 0.5, 0.03) << "enlarged";
  EXPECT_NEAR(at(30, 2), 0.5, 0.06);
}

// ITU-R BT.601 weights: 0.299 R + 0.587 G + 0.114 B.
TEST_F(ImageFileTest, ReadsColourPngAsGrey) {
  const Image eight = read_image(file("c8.png", encode_png({3, 1, 3, {255, 0, 0, 0, 255, 0, 0, 0, 255}, {}})));
  const Image sixteen = read_image(file("c16.png", encode_png({3, 1, 3, {}, {65535, 0, 0, 0, 65535, 0, 0, 0, 65535}})));
  ASSERT_EQ(eight.width, 3u);
  EXPECT_THAT(eight.values, Pointwise(FloatNear(0.5F / 255), {0.299F, 0.587F, 0.114F}));
  EXPECT_THAT(sixteen.values, Pointwise(FloatNear(0.5F / 65535 + 1e-6F), {0.299F, 0.587F, 0.114F}));
}

// Four columns of red and four of blue, written by Pillow.
TEST_F(ImageFileTest, ReadsJpegOfAnotherProgram) {
  const Image image = read_image(RELIGN_TEST_DATA "/images/red_blue.jpg");
  ASSERT_EQ(image.width, 8u);
  ASSERT_EQ(image.height, 4u);
  EXPECT_NEAR(image.at(1, 2), 0.299, 0.02);
  EXPECT_NEAR(image.at(6, 2), 0.114, 0.02);
}

TEST_F(ImageFileTest, RefusesHugeImagesBeforeUnpackingThem) {
  std::string png = encode_png({1, 1, 1, {0}, {}});
  for (const std::size_t at : {17U, 21U})
    png[at] = '\x7f';  // width and height of millions; libpng checks the CRC first
  EXPECT_THAT(refusal(file("huge.png", png), ErrorKind::bad_input), HasSubstr("huge.png"));
}

// Two pixels of 8 bits, 0 and 255, in one strip.
std::string small_tiff(std::uint16_t compression) {
  std::string bytes("II*\0\x08\0\0\0\x08\0", 10);  // eight entries, at byte 8
  const auto append = [&](std::uint32_t value, int size) {
    for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> 8 * i & 0xff);
  };
  constexpr std::uint32_t kAfterEntries = 8 + 2 + 8 * 12 + 4;
  for (const auto& [tag, value] : std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{
           {256, 2}, {257, 1}, {258, 8}, {259, compression}, {262, 1}, {273, kAfterEntries}, {278, 1}, {279, 2}}) {
    append(tag, 2);
    append(4, 2);  // a number of 32 bits
    append(1, 4);
    append(value, 4);
  }
  append(0, 4);
  return bytes + '\0' + '\xff';
}

TEST_F(ImageFileTest, RefusesJbigByName) {
  EXPECT_EQ(read_image(file("none.tiff", small_tiff(1))).values, (std::vector<float>{0, 1}));
  EXPECT_THAT(refusal(file("jbig.tiff", small_tiff(34661)), ErrorKind::bad_input),
              HasSubstr("its compression, JBIG, is not supported; save it without compression or with LZW"));
}

TEST_F(ImageFileTest, RejectsFilesThatAreNotImages) {
  EXPECT_THAT(refusal(folder_ / "missing.png", ErrorKind::io), HasSubstr("No such file"));
  EXPECT_THAT(refusal(folder_, ErrorKind::io), HasSubstr("folder"));
  EXPECT_THAT(refusal(file("empty.png", ""), ErrorKind::bad_input),
              HasSubstr("not an image that can be read; allowed: PNG, JPEG, TIFF, WebP"));
  EXPECT_THAT(refusal(file("text.png", "hello"), ErrorKind::bad_input),
              HasSubstr("not an image that can be read; allowed: PNG, JPEG, TIFF, WebP"));
  EXPECT_THAT(refusal(file("magic.png", "\x89PNG\r\n\x1a\n"), ErrorKind::bad_input), HasSubstr("ends too early"));
}

TEST_F(ImageFileTest, RejectsTruncatedImages) {
  Image noisy(64, 64);
  for (std::size_t i = 0; i < noisy.values.size(); ++i)
    noisy.values[i] = static_cast<float>(std::fmod(static_cast<double>(i) * 0.618, 1.0));
  write_film(folder_ / "a.webp", {noisy}, 64, 1);
  write_file_atomically(folder_ / "a.jpg", read_file(RELIGN_TEST_DATA "/images/red_blue.jpg"));
  for (const char* name : {"a.png", "a.tiff"}) write_image(folder_ / name, noisy);
  for (const char* name : {"a.png", "a.tiff", "a.webp", "a.jpg"}) {
    const std::string whole = read_file(folder_ / name);
    const fs::path cut = file(std::string("cut-") + name, whole.substr(0, whole.size() / 2));
    EXPECT_THAT(refusal(cut, ErrorKind::bad_input), HasSubstr("cut-")) << name;
  }
}

TEST_F(ImageFileTest, RejectsUnknownExtensions) {
  for (const char* name : {"a.jpg", "a.exr", "a", "a.png.bak"}) {
    try {
      write_image(folder_ / name, sample());
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_THAT(error.what(), HasSubstr("allowed: .png, .npy, .tiff"));
    }
    EXPECT_FALSE(fs::exists(folder_ / name));
  }
}

TEST_F(ImageFileTest, ReportsUnwritableFolderAsIoError) {
  for (const char* name : {"a.png", "a.npy", "a.tiff"}) {
    try {
      write_image(fs::path("/proc/nothing") / name, sample());
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::io);
    }
  }
}

}  // namespace
}  // namespace relign::images
