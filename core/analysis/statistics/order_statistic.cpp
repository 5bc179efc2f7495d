#include "statistics/order_statistic.h"

#include <algorithm>
#include <string>

#include "base/error.h"
#include "statistics/sorted_sample.h"

namespace relign::statistics {

OrderStatistic OrderStatistic::quantile(double share) {
  if (!(share >= 0 && share <= 1)) {
    throw Error(ErrorKind::bad_input, "quantile share " + std::to_string(share) + " must be in the range 0 to 1");
  }
  return {Kind::quantile, share};
}

double OrderStatistic::weight_below(std::size_t count, std::size_t n) const {
  const auto taken = static_cast<double>(count);
  const auto all = static_cast<double>(n);
  switch (kind_) {
    case Kind::mean:
      return taken / all;
    case Kind::trimmed:
      return std::clamp((taken - share_ * all) / ((1 - 2 * share_) * all), 0.0, 1.0);
    case Kind::quantile:
      break;
  }
  const double place = (all - 1) * share_;
  const auto below = static_cast<std::size_t>(place);
  if (count <= below) return 0;
  return count == below + 1 ? 1 - (place - static_cast<double>(below)) : 1;
}

double OrderStatistic::of(std::vector<double> values) const {
  const SortedSample sample(values);
  const std::vector<unsigned char> once(values.size(), 1);
  return sample.resampled(once.data(), *this);
}

}  // namespace relign::statistics
