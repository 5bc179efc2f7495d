#include "report/page_numbers.h"

#include <charconv>

#include "base/text.h"

namespace relign::report {
namespace {

constexpr int kShownDigits = 10;

}  // namespace

double rounded(double value, int digits) {
  if (!std::isfinite(value)) return value;
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits - 1);
  double result = value;
  std::from_chars(buffer, end.ptr, result);
  return result;
}

double shown(double value) { return std::isfinite(value) ? rounded(value, kShownDigits) : kMissing; }

statistics::Interval shown(const statistics::Interval& interval) { return {shown(interval.low), shown(interval.high)}; }

statistics::Band shown(const statistics::Band& band) { return {band.n, shown(band.estimate), shown(band.interval)}; }

std::vector<double> shown(std::vector<double> values) {
  for (double& value : values) value = shown(value);
  return values;
}

double shown_arrival(double value) { return std::isinf(value) ? value : shown(value); }

std::string number_text(double value, int digits) { return std::isfinite(value) ? significant(value, digits) : "-"; }

std::string sort_value(double value) { return std::isfinite(value) ? shortest(value) : ""; }

std::string whole_percent(double share) {
  return std::isfinite(share) ? std::to_string(std::lround(100 * share)) : "-";
}

std::string interval_text(const statistics::Interval& interval, int digits, const char* separator) {
  return interval.exists() ? number_text(interval.low, digits) + separator + number_text(interval.high, digits) : "";
}

}  // namespace relign::report
