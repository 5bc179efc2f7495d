// Gauss-Newton over shift, rotation, level and contrast on an image pyramid; see registration.h.
#include "images/registration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace relign::images {
namespace {

// Binomial blur with a standard deviation of 1 pixel, applied to both images: it preserves shifts, reduces noise and
// makes linear interpolation between pixels accurate.
Image smoothed(const View& view) {
  const auto clamped = [](std::ptrdiff_t place, std::size_t size) {
    return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(place, 0, static_cast<std::ptrdiff_t>(size) - 1));
  };
  constexpr double kWeights[5] = {1, 4, 6, 4, 1};
  Image across(view.width, view.height), both(view.width, view.height);
  for (const bool down : {false, true}) {
    const View from = down ? View(across) : view;
    Image& to = down ? both : across;
    for (std::size_t y = 0; y < view.height; ++y)
      for (std::size_t x = 0; x < view.width; ++x) {
        double sum = 0;
        for (int k = 0; k < 5; ++k) {
          const std::size_t column = down ? x : clamped(static_cast<std::ptrdiff_t>(x) + k - 2, view.width);
          const std::size_t row = down ? clamped(static_cast<std::ptrdiff_t>(y) + k - 2, view.height) : y;
          sum += kWeights[k] * from.at(column, row);
        }
        to.at(x, y) = static_cast<float>(sum / 16);
      }
  }
  return both;
}

Image halved(const View& view) {
  Image half(view.width / 2, view.height / 2);
  for (std::size_t y = 0; y < half.height; ++y)
    for (std::size_t x = 0; x < half.width; ++x)
      half.at(x, y) = static_cast<float>((view.at(2 * x, 2 * y) + view.at(2 * x + 1, 2 * y) +
                                          view.at(2 * x, 2 * y + 1) + view.at(2 * x + 1, 2 * y + 1)) /
                                         4);
  return half;
}

// One level of the pyramid, with both images. `middle_*` is the same point of the scene on every level.
struct Level {
  Image image, reference;
  double middle_x = 0, middle_y = 0;
};

// Unknowns in the order of elimination: a later one may be undetermined without affecting the earlier ones.
enum Unknown { kLevel, kContrast, kShiftX, kShiftY, kRotation, kUnknowns };

struct Fit {
  double level = 0, contrast = 1, shift_x = 0, shift_y = 0;
  double cosine = 1, sine = 0;
  bool determined[kUnknowns] = {};                             // by the images
  double left_over = std::numeric_limits<double>::infinity();  // unexplained share of the variance
};

// Normal equations. `own` is each diagonal element if no other unknown could explain the same change.
struct System {
  double a[kUnknowns][kUnknowns + 1] = {};
  double own[kUnknowns] = {};
  double count = 0, sum = 0, squares = 0, errors = 0;

  void add(double value, double error, const double (&slopes)[kUnknowns]) {
    for (int row = 0; row < kUnknowns; ++row) {
      for (int column = row; column < kUnknowns; ++column) a[row][column] += slopes[row] * slopes[column];
      a[row][kUnknowns] += slopes[row] * error;
    }
    count += 1;
    sum += value;
    squares += value * value;
    errors += error * error;
  }
  // Solves for the first `unknowns` steps; a step that the images do not determine is 0.
  void solve(int unknowns, bool (&determined)[kUnknowns], double (&steps)[kUnknowns]) {
    for (int row = 0; row < kUnknowns; ++row)
      for (int column = 0; column < row; ++column) a[row][column] = a[column][row];
    for (int k = 0; k < unknowns; ++k) {
      determined[k] = a[k][k] > 0.01 * own[k];
      if (!determined[k]) continue;
      for (int row = k + 1; row < unknowns; ++row) {
        const double factor = a[row][k] / a[k][k];
        for (int column = k; column <= kUnknowns; ++column) a[row][column] -= factor * a[k][column];
      }
    }
    for (int k = unknowns - 1; k >= 0; --k) {
      steps[k] = 0;
      if (!determined[k]) continue;
      double rest = a[k][kUnknowns];
      for (int column = k + 1; column < unknowns; ++column) rest -= a[k][column] * steps[column];
      steps[k] = rest / a[k][k];
    }
  }
};

System compare(const Level& at, const Fit& fit) {
  System system;
  const View image(at.image), reference(at.reference);
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const double dx = static_cast<double>(x) - at.middle_x - fit.shift_x;
      const double dy = static_cast<double>(y) - at.middle_y - fit.shift_y;
      const double px = fit.cosine * dx + fit.sine * dy, py = fit.cosine * dy - fit.sine * dx;
      const double column = at.middle_x + px, row = at.middle_y + py;
      if (!(column >= 0 && row >= 0 && column < static_cast<double>(image.width - 1) &&
            row < static_cast<double>(image.height - 1)))
        continue;
      const auto left = static_cast<std::size_t>(column), top = static_cast<std::size_t>(row);
      const double u = column - static_cast<double>(left), v = row - static_cast<double>(top);
      const double a = reference.at(left, top), b = reference.at(left + 1, top);
      const double c = reference.at(left, top + 1), d = reference.at(left + 1, top + 1);
      const double expected = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
      const double across = fit.contrast * ((1 - v) * (b - a) + v * (d - c));
      const double down = fit.contrast * ((1 - u) * (c - a) + u * (d - b));
      const double value = image.at(x, y);
      system.add(value, value - fit.level - fit.contrast * expected,
                 {1, expected, fit.sine * down - fit.cosine * across, -fit.sine * across - fit.cosine * down,
                  across * py - down * px});
      const double steepness = across * across + down * down;
      system.own[kContrast] += expected * expected;
      system.own[kShiftX] += steepness / 2;
      system.own[kShiftY] += steepness / 2;
      system.own[kRotation] += steepness * (px * px + py * py) / 2;
    }
  // Little structure is enough to determine the contrast.
  system.own[kContrast] *= 0.01;
  return system;
}

// Iterates until the fit has converged.
void refine(const Level& at, Fit& fit) {
  constexpr int kMaxSteps = 30;
  constexpr double kFurthest_px = 4, kMaxTurn = 0.1, kConverged_px = 1e-3;
  const double reach = std::max(at.middle_x, at.middle_y);
  for (int step = 0; step <= kMaxSteps; ++step) {
    System system = compare(at, fit);
    const double pixels = static_cast<double>(at.image.width * at.image.height);
    const double variance = system.squares - system.sum * system.sum / std::max(system.count, 1.0);
    // False for too little overlap, and for an image that is uniform up to rounding.
    const bool comparable = system.count > pixels / 4 && variance > 1e-10 * system.squares;
    fit.left_over = comparable ? system.errors / variance : std::numeric_limits<double>::infinity();
    // Level and contrast alone first: a wrong contrast scales the other steps.
    double steps[kUnknowns] = {};
    system.solve(step == 0 ? kShiftX : kUnknowns, fit.determined, steps);
    if (!fit.determined[kContrast] || std::isinf(fit.left_over)) return;
    fit.level += steps[kLevel];
    fit.contrast += steps[kContrast];
    if (step == 0) continue;
    const double x = std::clamp(steps[kShiftX], -kFurthest_px, kFurthest_px);
    const double y = std::clamp(steps[kShiftY], -kFurthest_px, kFurthest_px);
    const double turn = std::clamp(steps[kRotation], -kMaxTurn, kMaxTurn);
    fit.shift_x += x;
    fit.shift_y += y;
    // Rotation by approximately `turn`, without the C library's sine.
    const double square = turn * turn / 4, cosine = (1 - square) / (1 + square), sine = turn / (1 + square);
    const double before = fit.cosine;
    fit.cosine = before * cosine - fit.sine * sine;
    fit.sine = before * sine + fit.sine * cosine;
    if (std::fabs(x) + std::fabs(y) + std::fabs(turn) * reach < kConverged_px) return;
  }
}

// Arctangent by halving and a series: the same bits on every machine.
double angle_deg(double cosine, double sine) {
  double t = sine / (1 + cosine);  // tangent of half the angle
  for (int halving = 0; halving < 3; ++halving) t /= 1 + std::sqrt(1 + t * t);
  double sum = 0;
  for (int power = 15; power >= 1; power -= 2) sum = (power % 4 == 1 ? 1.0 : -1.0) / power + t * t * sum;
  return 16 * t * sum * 180 / std::numbers::pi;
}

std::vector<Level> pyramid(const View& image, const View& reference) {
  constexpr std::size_t kMaxLevels = 4, kSmallest = 24;
  std::vector<Level> levels;
  levels.push_back({smoothed(image), smoothed(reference), static_cast<double>(image.width - 1) / 2,
                    static_cast<double>(image.height - 1) / 2});
  while (levels.size() < kMaxLevels &&
         std::min(levels.back().image.width, levels.back().image.height) >= 2 * kSmallest) {
    const Level& fine = levels.back();
    levels.push_back({smoothed(halved(fine.image)), smoothed(halved(fine.reference)), (fine.middle_x - 0.5) / 2,
                      (fine.middle_y - 0.5) / 2});
  }
  return levels;
}

}  // namespace

Registration registration(const View& image, const View& reference) {
  constexpr double kMinExplained = 0.25;
  const Registration none{kNotMeasurable, kNotMeasurable, kNotMeasurable};
  if (image.width != reference.width || image.height != reference.height || image.width < 8 || image.height < 8)
    return none;
  const std::vector<Level> levels = pyramid(image, reference);
  const double coarseness = static_cast<double>(std::size_t{1} << (levels.size() - 1));
  const Moments here = moments(image), there = moments(reference);
  Fit best;
  for (const bool from_centroids : {false, true}) {
    Fit fit;
    if (from_centroids) {
      fit.shift_x = (here.centroid_x_px - there.centroid_x_px) / coarseness;
      fit.shift_y = (here.centroid_y_px - there.centroid_y_px) / coarseness;
      if (!std::isfinite(fit.shift_x) || !std::isfinite(fit.shift_y)) continue;
    }
    refine(levels.back(), fit);
    if (fit.left_over < best.left_over) best = fit;
  }
  for (std::size_t finer = levels.size() - 1; finer > 0; --finer) {
    best.shift_x *= 2;
    best.shift_y *= 2;
    refine(levels[finer - 1], best);
  }
  if (!(best.left_over < 1 - kMinExplained) || !best.determined[kContrast] || !(best.contrast > 0)) return none;
  return {best.determined[kShiftX] ? best.shift_x : kNotMeasurable,
          best.determined[kShiftY] ? best.shift_y : kNotMeasurable,
          best.determined[kRotation] ? angle_deg(best.cosine, best.sine) : kNotMeasurable};
}

}  // namespace relign::images
