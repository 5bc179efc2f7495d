#include "images/image_file.h"

#include <algorithm>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "base/error.h"
#include "base/files.h"

namespace relign::images {
namespace {

constexpr std::size_t kMostPixels = 100'000'000;
constexpr std::size_t kMostBytes = std::size_t{256} << 20;

void refuse_large(const std::filesystem::path& path, std::size_t pixels) {
  if (pixels > kMostPixels)
    throw Error(ErrorKind::bad_input, path.string() + ": the image has " + std::to_string(pixels) +
                                          " pixels; at most " + std::to_string(kMostPixels) + " are read");
}

// A PNG of a few bytes can be an image of gigabytes, so that its header is looked at before it is unpacked. 0: another
// kind of file, which OpenCV limits to 2^30 pixels.
std::size_t told_pixels(const std::string& bytes) {
  constexpr std::size_t kWidthAt = 16, kHeightAt = 20, kHeader = 24;
  if (bytes.size() < kHeader || bytes.compare(1, 3, "PNG") != 0) return 0;
  const auto side = [&bytes](std::size_t at) {
    std::size_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value << 8U | static_cast<unsigned char>(bytes[i]);
    return value;
  };
  return side(kWidthAt) * side(kHeightAt);
}

void write_encoded(const std::filesystem::path& path, const char* ending, const cv::Mat& matrix,
                   const std::vector<int>& parameters = {}) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(ending, matrix, bytes, parameters))
    throw Error(ErrorKind::internal, "OpenCV cannot write " + std::string(ending) + " files");
  write_file_atomically(path, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
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
  const std::string bytes = read_file(path, kMostBytes);
  refuse_large(path, told_pixels(bytes));
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  cv::Mat decoded;
  try {
    if (!bytes.empty()) decoded = cv::imdecode(encoded, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  } catch (const cv::Exception&) {
    decoded.release();  // an empty matrix is the failure below
  }
  if (decoded.empty())
    throw Error(ErrorKind::bad_input,
                path.string() + ": this is no image that can be read (PNG, TIFF, JPEG, BMP and PGM can)");
  refuse_large(path, decoded.total());
  double scale = 1;
  if (decoded.depth() == CV_8U) scale = 1.0 / 255;
  if (decoded.depth() == CV_16U) scale = 1.0 / 65535;
  Image image(static_cast<std::size_t>(decoded.cols), static_cast<std::size_t>(decoded.rows));
  cv::Mat target = view(image);
  decoded.convertTo(target, CV_32F, scale);
  return image;
}

void write_image(const std::filesystem::path& path, const Image& image, float white) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".npy") {
    write_file_atomically(path, npy_bytes(image));
  } else if (ending == ".png") {
    cv::Mat out;
    view(image).convertTo(out, CV_16U, 65535.0 / white);
    write_encoded(path, ".png", out);
  } else if (ending == ".tiff" || ending == ".tif") {
    write_encoded(path, ".tiff", view(image));
  } else {
    throw Error(ErrorKind::bad_input,
                path.string() + ": cannot write '" + ending + "' images; use .png, .npy or .tiff");
  }
}

void write_preview(const std::filesystem::path& path, const Image& image, float white) {
  cv::Mat out;
  view(image).convertTo(out, CV_8U, 255.0 / white);
  write_encoded(path, ".png", out);
}

void write_film(const std::filesystem::path& path, const std::vector<Image>& images, unsigned tile, float white) {
  constexpr int kQuality = 60;  // of 100: noise is what costs, and nobody looks for it here
  const auto side = static_cast<int>(tile);
  cv::Mat film = cv::Mat::zeros(side, side * static_cast<int>(images.size()), CV_8U);
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
  write_encoded(path, ".webp", film, {cv::IMWRITE_WEBP_QUALITY, kQuality});
}

}  // namespace relign::images
