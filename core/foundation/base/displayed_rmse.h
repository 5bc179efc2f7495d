// How a signed, unbiased mean squared error is shown.
#pragma once

#include <cmath>

namespace relign {

// sqrt(max(0, mse)): noise may bring an error near 0 below it. NaN, which stands for unknown, stays NaN.
inline double displayed_rmse(double mse) { return mse <= 0 ? 0 : std::sqrt(mse); }

}  // namespace relign
