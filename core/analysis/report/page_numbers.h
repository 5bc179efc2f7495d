// Numbers as a report shows them: rounded once, so that the page, the tables and the JSON document agree. NaN is
// unknown, and infinite steps or seconds mean that fewer than half of the instances arrive.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "base/text.h"
#include "statistics/band.h"

namespace relign::report {

using statistics::kMissing;

// `value` with that many significant digits.
double rounded(double value, int digits);

// Rounded to ten digits; NaN if not finite.
double shown(double value);
statistics::Interval shown(const statistics::Interval& interval);
statistics::Band shown(const statistics::Band& band);
std::vector<double> shown(std::vector<double> values);

// As `shown`, but infinity remains.
double shown_arrival(double value);

std::string number_text(double value, int digits = 3);  // "-" if not finite
std::string sort_value(double value);                   // for data-sort; "" if not finite
std::string whole_percent(double share);                // "57"; "-" if not finite

// "LOW - HIGH" with the separator; "" without an interval.
std::string interval_text(const statistics::Interval& interval, int digits, const char* separator);

}  // namespace relign::report
