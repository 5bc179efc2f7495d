#include "images/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace relign::images {
namespace {

double border_median(const View& image) {
  std::vector<float> border;
  for (std::size_t x = 0; x < image.width; ++x) {
    border.push_back(image.values[x]);
    border.push_back(image.values[(image.height - 1) * image.width + x]);
  }
  for (std::size_t y = 0; y < image.height; ++y) {
    border.push_back(image.values[y * image.width]);
    border.push_back(image.values[y * image.width + image.width - 1]);
  }
  const auto middle = border.begin() + static_cast<std::ptrdiff_t>(border.size() / 2);
  std::nth_element(border.begin(), middle, border.end());
  return static_cast<double>(*middle);
}

// Solves a 3 x 3 system by Gaussian elimination with pivoting; false if it is singular.
bool solve3(double (&a)[3][4], double (&x)[3]) {
  for (int column = 0; column < 3; ++column) {
    int pivot = column;
    for (int row = column + 1; row < 3; ++row)
      if (std::fabs(a[row][column]) > std::fabs(a[pivot][column])) pivot = row;
    if (!(std::fabs(a[pivot][column]) > 1e-9)) return false;
    for (int k = 0; k < 4; ++k) std::swap(a[column][k], a[pivot][k]);
    for (int row = column + 1; row < 3; ++row) {
      const double factor = a[row][column] / a[column][column];
      for (int k = column; k < 4; ++k) a[row][k] -= factor * a[column][k];
    }
  }
  for (int row = 2; row >= 0; --row) {
    x[row] = a[row][3];
    for (int k = row + 1; k < 3; ++k) x[row] -= a[row][k] * x[k];
    x[row] /= a[row][row];
  }
  return true;
}

}  // namespace

double mean(const View& image) {
  double sum = 0;
  for (std::size_t y = 0; y < image.height; ++y) {
    double row = 0;  // sums per row lose less precision
    for (std::size_t x = 0; x < image.width; ++x) row += image.at(x, y);
    sum += row;
  }
  return sum / static_cast<double>(image.width * image.height);
}

double contrast(const View& image) {
  const double level = mean(image);
  double squares = 0;
  for (std::size_t y = 0; y < image.height; ++y) {
    double row = 0;
    for (std::size_t x = 0; x < image.width; ++x) row += (image.at(x, y) - level) * (image.at(x, y) - level);
    squares += row;
  }
  return level > 0 ? std::sqrt(squares / static_cast<double>(image.width * image.height)) / level : kNotMeasurable;
}

double sharpness(const View& image) {
  const double level = mean(image);
  if (!(level > 0) || image.width < 3 || image.height < 3) return kNotMeasurable;
  double energy = 0;
  for (std::size_t y = 1; y + 1 < image.height; ++y) {
    double row = 0;
    for (std::size_t x = 1; x + 1 < image.width; ++x) {
      const double across = (image.at(x + 1, y) - image.at(x - 1, y)) / 2;
      const double down = (image.at(x, y + 1) - image.at(x, y - 1)) / 2;
      row += across * across + down * down;
    }
    energy += row;
  }
  return energy / static_cast<double>((image.width - 2) * (image.height - 2)) / (level * level);
}

Moments moments(const View& image) {
  const double background = border_median(image);
  double sum = 0, sum_x = 0, sum_y = 0, magnitude = 0;
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const double light = image.at(x, y) - background;
      sum += light;
      sum_x += light * static_cast<double>(x);
      sum_y += light * static_cast<double>(y);
      magnitude += std::fabs(light);
    }
  // Without net light above the background there is no centroid.
  if (!(std::fabs(sum) > 1e-6 * magnitude)) return {kNotMeasurable, kNotMeasurable, kNotMeasurable};
  Moments found;
  found.centroid_x_px = sum_x / sum;
  found.centroid_y_px = sum_y / sum;
  double squares = 0;
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const double dx = static_cast<double>(x) - found.centroid_x_px;
      const double dy = static_cast<double>(y) - found.centroid_y_px;
      squares += (image.at(x, y) - background) * (dx * dx + dy * dy);
    }
  const double variance = squares / sum / 2;
  found.width_px = variance >= 0 ? std::sqrt(variance) : kNotMeasurable;
  return found;
}

double star_contrast(const View& image, const StarCircle& circle) {
  // Wide enough for a few hundred pixels, narrow enough that the frequency varies little across the ring.
  const double half_ring_px = std::max(1.0, 0.03 * circle.radius_px);
  const double outer = circle.radius_px + half_ring_px;
  if (!(circle.radius_px > half_ring_px) || circle.cycles < 1 || !(circle.x_px - outer >= 0) ||
      !(circle.y_px - outer >= 0) || !(circle.x_px + outer <= static_cast<double>(image.width - 1)) ||
      !(circle.y_px + outer <= static_cast<double>(image.height - 1)))
    return kNotMeasurable;

  // Normal equations of level + a cos(cycles * angle) + b sin(cycles * angle).
  double system[3][4] = {};
  std::size_t pixels = 0;
  for (auto y = static_cast<std::size_t>(circle.y_px - outer); y <= static_cast<std::size_t>(circle.y_px + outer); ++y)
    for (auto x = static_cast<std::size_t>(circle.x_px - outer); x <= static_cast<std::size_t>(circle.x_px + outer);
         ++x) {
      const double dx = static_cast<double>(x) - circle.x_px;
      const double dy = static_cast<double>(y) - circle.y_px;
      const double radius = std::sqrt(dx * dx + dy * dy);
      if (std::fabs(radius - circle.radius_px) > half_ring_px) continue;
      // (cos + i sin)^cycles by multiplication only: the same bits on every machine.
      const double cosine = dx / radius, sine = dy / radius;
      double wave[3] = {1, 1, 0};
      for (int power = 0; power < circle.cycles; ++power) {
        const double real = wave[1] * cosine - wave[2] * sine;
        wave[2] = wave[1] * sine + wave[2] * cosine;
        wave[1] = real;
      }
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) system[row][column] += wave[row] * wave[column];
        system[row][3] += wave[row] * image.at(x, y);
      }
      ++pixels;
    }
  if (pixels < 4 * static_cast<std::size_t>(circle.cycles)) return kNotMeasurable;
  double solution[3];
  if (!solve3(system, solution) || !(solution[0] > 0)) return kNotMeasurable;
  return std::sqrt(solution[1] * solution[1] + solution[2] * solution[2]) / solution[0];
}

}  // namespace relign::images
