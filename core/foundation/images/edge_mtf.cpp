// Slanted-edge MTF after ISO 12233; see measures.h.
#include <algorithm>
#include <cmath>
#include <limits>
#include <relign/portable_math.hpp>
#include <utility>
#include <vector>

#include "images/measures.h"

namespace relign::images {
namespace {

constexpr int kBinsPerPixel = 4;

// The region, transposed if needed so that the edge runs from top to bottom.
struct Patch {
  const View& image;
  Region region;
  bool transposed = false;
  std::size_t width() const { return transposed ? region.height : region.width; }
  std::size_t height() const { return transposed ? region.width : region.height; }
  double at(std::size_t x, std::size_t y) const {
    return transposed ? image.at(region.x + y, region.y + x) : image.at(region.x + x, region.y + y);
  }
};

// True if the edge is closer to horizontal: the light changes more from row to row than from column to column.
bool is_horizontal(const Patch& patch) {
  double across = 0, down = 0;
  for (std::size_t y = 0; y + 1 < patch.height(); ++y)
    for (std::size_t x = 0; x + 1 < patch.width(); ++x) {
      across += std::fabs(patch.at(x + 1, y) - patch.at(x, y));
      down += std::fabs(patch.at(x, y + 1) - patch.at(x, y));
    }
  return down > across;
}

// x = offset + slope * y
struct Line {
  double offset = 0;
  double slope = 0;
  double at(double y) const { return offset + slope * y; }
};

// Fits a line through the centroids of the rows' derivatives, within half_window_px of `guess` if there is one. The
// derivative is taken over `span` pixels: a long one averages noise. False without an edge.
bool fit_line(const Patch& patch, const Line* guess, double half_window_px, std::size_t span, Line& line) {
  double n = 0, sum_y = 0, sum_x = 0, sum_yy = 0, sum_yx = 0;
  for (std::size_t row = 0; row < patch.height(); ++row) {
    const auto y = static_cast<double>(row);
    double weight = 0, moment = 0, magnitude = 0;
    for (std::size_t column = 0; column + span < patch.width(); ++column) {
      const double x = static_cast<double>(column) + static_cast<double>(span) / 2;
      if (guess && std::fabs(x - guess->at(y)) > half_window_px) continue;
      const double rise = patch.at(column + span, row) - patch.at(column, row);
      weight += rise;
      moment += rise * x;
      magnitude += std::fabs(rise);
    }
    if (!(std::fabs(weight) > 0.2 * magnitude)) continue;  // noise, or no edge in this row
    const double x = moment / weight;
    n += 1;
    sum_y += y;
    sum_x += x;
    sum_yy += y * y;
    sum_yx += y * x;
  }
  const double spread = n * sum_yy - sum_y * sum_y;
  if (n < 0.5 * static_cast<double>(patch.height()) || n < 5 || !(spread > 0)) return false;
  line.slope = (n * sum_yx - sum_y * sum_x) / spread;
  line.offset = (sum_x - line.slope * sum_y) / n;
  return true;
}

// One bin of the edge spread function: mean value and mean place of its pixels. Pixels do not fill bins evenly; using
// the centre of the bin instead of the mean place would cost several per cent of the MTF at high frequencies.
struct Bin {
  double value = 0;
  double place_px = 0;  // distance from the edge
};

// The edge spread function along the edge's normal, kBinsPerPixel bins per pixel, with the edge at 0. Empty if a bin
// has no pixel because the edge is not slanted enough.
std::vector<Bin> profile_of(const Patch& patch, const Line& line, double half_length_px) {
  const double cosine = 1 / std::sqrt(1 + line.slope * line.slope);
  const auto half = static_cast<std::ptrdiff_t>(half_length_px * kBinsPerPixel);
  std::vector<Bin> profile(static_cast<std::size_t>(2 * half));
  std::vector<double> counts(profile.size(), 0.0);
  for (std::size_t row = 0; row < patch.height(); ++row)
    for (std::size_t column = 0; column < patch.width(); ++column) {
      const double distance = (static_cast<double>(column) - line.at(static_cast<double>(row))) * cosine;
      const double place = std::floor(distance * kBinsPerPixel) + static_cast<double>(half);
      if (!(place >= 0) || place >= static_cast<double>(profile.size())) continue;
      const auto bin = static_cast<std::size_t>(place);
      profile[bin].value += patch.at(column, row);
      profile[bin].place_px += distance;
      counts[bin] += 1;
    }
  for (std::size_t bin = 0; bin < profile.size(); ++bin) {
    if (counts[bin] == 0) return {};
    profile[bin].value /= counts[bin];
    profile[bin].place_px /= counts[bin];
  }
  return profile;
}

// From the place where the profile has risen by a quarter to that by three quarters, pixels; infinity for an edge that
// does not rise by that between its ends.
double width_of(const std::vector<Bin>& profile) {
  const std::size_t ends = std::max<std::size_t>(1, profile.size() / 8);
  double first = 0, last = 0;
  for (std::size_t k = 0; k < ends; ++k) {
    first += profile[k].value / static_cast<double>(ends);
    last += profile[profile.size() - 1 - k].value / static_cast<double>(ends);
  }
  // Bins of two pixels: a single one is too noisy.
  constexpr std::size_t kMean = 2 * kBinsPerPixel;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  double sum = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    sum += profile[k].value;
    if (k < kMean) continue;
    sum -= profile[k - kMean].value;
    const double risen = (sum / kMean - first) / (last - first), place = profile[k - kMean / 2].place_px;
    if (risen >= 0.25) low = std::min(low, place);
    if (risen <= 0.75) high = std::max(high, place);
  }
  return low < high ? high - low : 0;
}

// sin(pi x) / (pi x) for |x| <= 1 by its power series, remainder below 1e-11.
double sinc(double x) {
  constexpr double kInverse[] = {1.0 / 6,   1.0 / 20,  1.0 / 42,  1.0 / 72,  1.0 / 110, 1.0 / 156,
                                 1.0 / 210, 1.0 / 272, 1.0 / 342, 1.0 / 420, 1.0 / 506};  // 1 / (2 k (2 k + 1))
  const double square = 9.8696044010893586 * x * x;
  double sum = 1;
  for (int k = 10; k >= 0; --k) sum = 1 - square * kInverse[k] * sum;
  return sum;
}

}  // namespace

double edge_mtf(const View& image, const Region& region, double cycles_per_pixel) {
  if (region.width < 8 || region.height < 8 || region.x + region.width > image.width ||
      region.y + region.height > image.height || !(cycles_per_pixel >= 0) || !(cycles_per_pixel <= 1))
    return kNotMeasurable;
  Patch patch{image, region};
  patch.transposed = is_horizontal(patch);

  Line line;
  const std::size_t span = std::clamp<std::size_t>(patch.width() / 16, 1, 8);
  if (!fit_line(patch, nullptr, 0, span, line)) return kNotMeasurable;
  // Fit again near the first line: far from the edge there is only noise. Nearer still, if the edge is that narrow.
  const auto width = static_cast<double>(patch.width());
  const Line first = line;
  if (!fit_line(patch, &first, std::max(4.0, width / 4), span, line)) return kNotMeasurable;
  for (int pass = 0; pass < 2; ++pass) {
    const Line guess = line;
    if (!fit_line(patch, &guess, std::max(8.0, width / 12), 1, line)) line = guess;
  }

  // Extent of the profile: as far as every row reaches on both sides of the edge.
  const double cosine = 1 / std::sqrt(1 + line.slope * line.slope);
  const double top = line.at(0), bottom = line.at(static_cast<double>(patch.height() - 1));
  const double margin = std::min(std::min(top, bottom), static_cast<double>(patch.width() - 1) - std::max(top, bottom));
  if (!(margin * cosine >= 3)) return kNotMeasurable;
  double half_length = margin * cosine;
  std::vector<Bin> profile = profile_of(patch, line, half_length);
  if (profile.size() < 8) return kNotMeasurable;
  // Beyond the edge there is only noise: keep what is near.
  constexpr double kShortest_px = 16, kWidths = 6;
  const double enough = std::max(kShortest_px, kWidths * width_of(profile));
  if (const auto surplus = static_cast<std::ptrdiff_t>((half_length - enough) * kBinsPerPixel); surplus > 0) {
    profile = {profile.begin() + surplus, profile.end() - surplus};
    half_length -= static_cast<double>(surplus) / kBinsPerPixel;
  }

  // Fourier transform of the derivative, with the outer halves, where there is only noise, tapered.
  double real = 0, imaginary = 0, level = 0;
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const double place = (profile[k].place_px + profile[k + 1].place_px) / 2;
    const double share = std::fabs(place) / half_length;
    const double taper =
        share <= 0.5 ? 1.0 : 0.5 + 0.5 * portable_sine_cosine(360 * (std::min(share, 1.0) - 0.5)).cosine;
    const double rise = taper * (profile[k + 1].value - profile[k].value);
    const double turns = cycles_per_pixel * place;
    const SineCosine wave = portable_sine_cosine(360 * (turns - std::floor(turns)));
    // A difference averages the derivative over the distance between its ends.
    const double blur = sinc(cycles_per_pixel * (profile[k + 1].place_px - profile[k].place_px));
    real += rise * wave.cosine / blur;
    imaginary += rise * wave.sine / blur;
    level += rise;
  }
  const auto less = [](const Bin& a, const Bin& b) { return a.value < b.value; };
  const auto [lowest, highest] = std::minmax_element(profile.begin(), profile.end(), less);
  // Not a step from one level to another.
  if (!(std::fabs(level) > 0.5 * (highest->value - lowest->value))) return kNotMeasurable;
  const double bin_blur = sinc(cycles_per_pixel / kBinsPerPixel);  // each bin averages over its width
  return std::sqrt(real * real + imaginary * imaginary) / std::fabs(level) / bin_blur;
}

}  // namespace relign::images
