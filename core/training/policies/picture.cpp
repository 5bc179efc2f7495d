#include "picture.hpp"

#include <algorithm>
#include <cmath>

namespace relign::policies {
namespace {

// Weights of the pixels first, first + 1, ... in one output pixel.
struct Part {
  std::size_t first = 0;
  std::vector<float> shares;
};

std::vector<Part> parts_of(std::size_t pixels, std::size_t columns) {
  std::vector<Part> parts(columns);
  const double width = static_cast<double>(pixels) / static_cast<double>(columns);
  for (std::size_t column = 0; column < columns; ++column) {
    const double begin = static_cast<double>(column * pixels) / static_cast<double>(columns);
    const double end = static_cast<double>((column + 1) * pixels) / static_cast<double>(columns);
    Part& part = parts[column];
    part.first = column * pixels / columns;
    for (std::size_t pixel = part.first; static_cast<double>(pixel) < end && pixel < pixels; ++pixel) {
      const double inside = std::min(end, static_cast<double>(pixel + 1)) - std::max(begin, static_cast<double>(pixel));
      part.shares.push_back(static_cast<float>(std::max(0.0, inside) / width));
    }
  }
  return parts;
}

}  // namespace

std::vector<float> resampled(const ImageView& image, int columns, int rows) {
  const auto side = static_cast<std::size_t>(columns), lines = static_cast<std::size_t>(rows > 0 ? rows : columns);
  const std::vector<Part> across = parts_of(image.width(), side);
  const std::vector<Part> down = parts_of(image.height(), lines);
  std::vector<float> picture(lines * side);
  for (std::size_t row = 0; row < lines; ++row)
    for (std::size_t y = 0; y < down[row].shares.size(); ++y) {
      const float* pixels = image.row(down[row].first + y);
      for (std::size_t column = 0; column < side; ++column) {
        const Part& part = across[column];
        float sum = 0;
        for (std::size_t x = 0; x < part.shares.size(); ++x) sum += part.shares[x] * pixels[part.first + x];
        picture[row * side + column] += down[row].shares[y] * sum;
      }
    }
  return picture;
}

void to_bytes(std::vector<float>& picture, double white, double byte_whites) {
  const auto scale = static_cast<float>(255 / (byte_whites * white));
  for (float& value : picture) {
    const float scaled = std::floor(value * scale + 0.5F);
    value = scaled > 0 ? std::min(scaled, 255.0F) : 0.0F;  // NaN is not above 0
  }
}

double rmse(const ImageView& one, const ImageView& other) {
  double sum = 0;
  for (std::size_t y = 0; y < one.height(); ++y) {
    const float *here = one.row(y), *there = other.row(y);
    for (std::size_t x = 0; x < one.width(); ++x) {
      const double off = static_cast<double>(here[x]) - static_cast<double>(there[x]);
      sum += off * off;
    }
  }
  return std::sqrt(sum / (static_cast<double>(one.width()) * static_cast<double>(one.height())));
}

}  // namespace relign::policies
