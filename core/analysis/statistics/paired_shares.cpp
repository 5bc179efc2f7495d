#include "statistics/paired_shares.h"

#include <algorithm>
#include <string>

#include "base/error.h"
#include "statistics/distributions.h"

namespace relign::statistics {

PairedShares compare_shares(const std::vector<bool>& first, const std::vector<bool>& second) {
  if (first.size() != second.size())
    throw Error(ErrorKind::internal, "paired columns have " + std::to_string(first.size()) + " and " +
                                         std::to_string(second.size()) + " instances; give the same instances to both");
  PairedShares shares;
  shares.n = first.size();
  for (std::size_t i = 0; i < first.size(); ++i) {
    shares.first += first[i] ? 1 : 0;
    shares.second += second[i] ? 1 : 0;
    shares.first_alone += first[i] && !second[i] ? 1 : 0;
    shares.second_alone += second[i] && !first[i] ? 1 : 0;
  }
  if (shares.n == 0) return shares;
  const std::size_t fewer = std::min(shares.first_alone, shares.second_alone);
  shares.p = std::min(1.0, 2 * fair_coin_lower(fewer, shares.first_alone + shares.second_alone));
  return shares;
}

}  // namespace relign::statistics
