#include "images/image_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "images/codecs.h"

namespace relign::images {
namespace {

constexpr std::size_t kMaxPixels = 100'000'000;
constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

// Values times `scale`, rounded to nearest, ties to even, and clipped to the samples' range.
template <class Sample>
std::vector<Sample> quantised(const Image& image, float scale) {
  constexpr float kMost = std::numeric_limits<Sample>::max();
  std::vector<Sample> samples(image.values.size());
  std::transform(image.values.begin(), image.values.end(), samples.begin(), [scale](float value) {
    const float scaled = std::nearbyint(value * scale);
    return static_cast<Sample>(scaled > 0 ? (scaled < kMost ? scaled : kMost) : 0);
  });
  return samples;
}

cv::Mat view(const Image& image) {
  return cv::Mat(static_cast<int>(image.height), static_cast<int>(image.width), CV_32FC1,
                 const_cast<float*>(image.values.data()));
}

// NumPy format 1.0: magic, version, header length, a Python dictionary, padding to 64 bytes, data.
std::string npy_bytes(const Image& image) {
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(image.height) + ", " +
                       std::to_string(image.width) + "), }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 255);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(image.values.data()), image.values.size() * sizeof(float));
  return bytes;
}

}  // namespace

Image read_image(const std::filesystem::path& path) {
  const std::string bytes = read_file(path, kMaxBytes);
  try {
    GreyPixels decoded = decode_grey(bytes, kMaxPixels);
    Image image(decoded.width, decoded.height);
    image.values = std::move(decoded.values);
    return image;
  } catch (const Error& error) {
    throw Error(error.kind(), path.string() + ": " + error.what());
  }
}

void write_image(const std::filesystem::path& path, const Image& image, float white) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".npy") {
    write_file_atomically(path, npy_bytes(image));
  } else if (ending == ".png") {
    write_file_atomically(
        path, encode_png({image.width, image.height, 1, {}, quantised<std::uint16_t>(image, 65535.0F / white)}));
  } else if (ending == ".tiff" || ending == ".tif") {
    write_file_atomically(path, encode_tiff(image.width, image.height, image.values.data()));
  } else {
    throw Error(ErrorKind::bad_input,
                path.string() + ": unknown image format '" + ending + "'; allowed: .png, .npy, .tiff");
  }
}

void write_preview(const std::filesystem::path& path, const Image& image, float white) {
  write_file_atomically(path,
                        encode_png({image.width, image.height, 1, quantised<std::uint8_t>(image, 255.0F / white), {}}));
}

void write_film(const std::filesystem::path& path, const std::vector<Image>& images, unsigned tile, float white) {
  constexpr float kQuality = 20;  // of 100: tiles look like those of 60, whose image noise costs half as much again
  const auto side = static_cast<int>(tile);
  // Not Mat::zeros: expressions of matrices would link LAPACK.
  cv::Mat film(side, side * static_cast<int>(images.size()), CV_8U, cv::Scalar(0));
  for (std::size_t number = 0; number < images.size(); ++number) {
    const Image& image = images[number];
    const double scale = tile / static_cast<double>(std::max(image.width, image.height));
    const cv::Size size(std::max(1, cvRound(scale * static_cast<double>(image.width))),
                        std::max(1, cvRound(scale * static_cast<double>(image.height))));
    cv::Mat fitted, grey;
    cv::resize(view(image), fitted, size, 0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_NEAREST);
    fitted.convertTo(grey, CV_8U, 255.0 / white);
    const cv::Point corner(static_cast<int>(number) * side + (side - size.width) / 2, (side - size.height) / 2);
    grey.copyTo(film(cv::Rect(corner, size)));
  }
  write_file_atomically(path, encode_webp({static_cast<std::size_t>(film.cols),
                                           static_cast<std::size_t>(film.rows),
                                           1,
                                           {film.datastart, film.dataend},
                                           {}},
                                          kQuality));
}

}  // namespace relign::images
