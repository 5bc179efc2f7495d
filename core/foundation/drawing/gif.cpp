#include "drawing/gif.h"

#include <gif_lib.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace relign::drawing {
namespace {

void check_gif(int result) {
  if (result != GIF_OK) throw Error(ErrorKind::internal, "giflib cannot write an animation");
}

int append_bytes(GifFileType* file, const GifByteType* bytes, int count) {
  static_cast<std::string*>(file->UserData)->append(bytes, bytes + count);
  return count;
}

}  // namespace

GreyGif::GreyGif(int width, int height, double frames_per_second)
    : width_(width), height_(height), frames_per_second_(std::min(frames_per_second, kMaxFramesPerSecond)) {
  constexpr int kGreys = 256, kBits = 8;
  file_.reset(EGifOpen(&bytes_, append_bytes, nullptr));
  check_gif(file_ ? GIF_OK : GIF_ERROR);
  EGifSetGifVersion(file_.get(), true);  // 89a, with delays
  const std::unique_ptr<ColorMapObject, decltype(&GifFreeMapObject)> greys(GifMakeMapObject(kGreys, nullptr),
                                                                           GifFreeMapObject);
  for (int grey = 0; grey < kGreys; ++grey) {
    const auto level = static_cast<GifByteType>(grey);
    greys->Colors[grey] = {level, level, level};
  }
  check_gif(EGifPutScreenDesc(file_.get(), width, height, kBits, 0, greys.get()));
  check_gif(EGifPutExtensionLeader(file_.get(), APPLICATION_EXT_FUNC_CODE));
  check_gif(EGifPutExtensionBlock(file_.get(), 11, "NETSCAPE2.0"));
  check_gif(EGifPutExtensionBlock(file_.get(), 3, "\1\0\0"));  // loop for ever
  check_gif(EGifPutExtensionTrailer(file_.get()));
}

void GreyGif::Close::operator()(GifFileType* file) const { EGifCloseFile(file, nullptr); }

void GreyGif::add(std::vector<std::uint8_t> grey) {
  // Delays are in hundredths of a second, rounded so that their sum keeps the rate.
  const auto until = [&](int frames) { return static_cast<int>(std::lround(100.0 * frames / frames_per_second_)); };
  const GraphicsControlBlock control{DISPOSE_DO_NOT, false, std::min(until(frames_ + 1) - until(frames_), 65535),
                                     NO_TRANSPARENT_COLOR};
  GifByteType extension[4];
  EGifGCBToExtension(&control, extension);
  check_gif(EGifPutExtension(file_.get(), GRAPHICS_EXT_FUNC_CODE, sizeof extension, extension));
  check_gif(EGifPutImageDesc(file_.get(), 0, 0, width_, height_, false, nullptr));
  check_gif(EGifPutLine(file_.get(), grey.data(), static_cast<int>(grey.size())));
  ++frames_;
}

std::string GreyGif::take() {
  check_gif(EGifCloseFile(file_.release(), nullptr));
  return std::move(bytes_);
}

}  // namespace relign::drawing
