#include "report/chart_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/text.h"
#include "report/page_numbers.h"

namespace relign::report {
namespace {

constexpr double kSlack = 1e-9;
constexpr double kNoDecade = 0.8;    // below this, tick marks as on a linear axis
constexpr double kFewDecades = 2.2;  // below this, tick marks at 2 and 5 as well
constexpr int kTickDigits = 6;       // hides rounding errors as of k * 0.1

std::string tick_text(double value) {
  const std::string text = shortest(rounded(value, kTickDigits));
  return text == "-0" ? "0" : text;
}

double round_step(double least) {
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= least * (1 - kSlack)) return factor * power;
  return 10 * power;
}

}  // namespace

ChartScale::ChartScale(double low, double high, bool logarithmic, double from, double to)
    : low_(logarithmic ? std::log10(low) : low),
      high_(logarithmic ? std::log10(high) : high),
      from_(from),
      to_(to),
      logarithmic_(logarithmic) {}

double ChartScale::operator()(double value) const {
  if (std::isnan(value)) return value;
  if (logarithmic_) value = value > 0 ? std::log10(value) : low_;
  return from_ + (to_ - from_) * (std::clamp(value, low_, high_) - low_) / (high_ - low_);
}

std::vector<std::pair<double, std::string>> ChartScale::marks(int count, bool whole) const {
  std::vector<std::pair<double, std::string>> all;
  const auto add = [&](double value) { all.emplace_back(value, tick_text(value)); };
  if (!logarithmic_) {
    double step = round_step((high_ - low_) / count);
    if (whole) step = std::max(step, 1.0);
    for (double k = std::ceil(low_ / step - kSlack); k * step <= high_ + kSlack * step; ++k) add(k * step);
    return all;
  }
  if (high_ - low_ < kNoDecade) {
    const double low = std::pow(10.0, low_), high = std::pow(10.0, high_);
    const double step = std::max(round_step((high - low) / count), whole ? 1.0 : 0.0);
    for (double k = std::ceil(low / step - kSlack); k * step <= high * (1 + kSlack); ++k) add(k * step);
    return all;
  }
  const bool fine = high_ - low_ < kFewDecades;
  // Over many decades only every second or third has a mark.
  const int every = std::max(1, static_cast<int>(std::ceil((high_ - low_) / count)));
  for (int power = static_cast<int>(std::floor(low_)); power <= high_; ++power)
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor > 1 && !fine) continue;
      if (factor == 1 && !fine && power % every != 0) continue;
      const double place = power + std::log10(factor);
      if (place < low_ - kSlack || place > high_ + kSlack) continue;
      if (!whole || place > -kSlack) add(factor * std::pow(10.0, power));
    }
  return all;
}

std::string pixels_text(double value) {
  const double tenths = std::round(value * 10) / 10;
  return shortest(tenths == 0 ? 0.0 : tenths);
}

std::vector<double> spread_labels(const std::vector<double>& wanted, double top, double bottom, double height) {
  std::vector<double> places(wanted.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<std::size_t> order;
  const double room = bottom < top ? 0 : std::floor((bottom - top) / height) + 1;
  for (std::size_t i = 0; i < wanted.size() && static_cast<double>(order.size()) < room; ++i)
    if (std::isfinite(wanted[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return wanted[a] < wanted[b]; });
  double least = top;
  for (const std::size_t i : order) {
    places[i] = std::max(wanted[i], least);
    least = places[i] + height;
  }
  double most = bottom;
  for (auto i = order.rbegin(); i != order.rend(); ++i) {
    places[*i] = std::min(places[*i], most);
    most = places[*i] - height;
  }
  return places;
}

}  // namespace relign::report
