// Converts a signed, unbiased mean squared error into the RMSE that is displayed.
#pragma once

#include <cmath>

namespace relign {

// sqrt(max(0, mse)); the estimate of an error near 0 may be negative. NaN (unknown) stays NaN.
inline double displayed_rmse(double mse) { return mse <= 0 ? 0 : std::sqrt(mse); }

}  // namespace relign
