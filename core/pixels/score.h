// Distances between images.
#pragma once

#include <cstddef>

namespace relign::pixels {

// sqrt(mean((a - b)^2)) over `count` values, summed in double in index order.
double rmse(const float* a, const float* b, std::size_t count);

// sqrt(max(0, mse)): how a signed, unbiased MSE is displayed.
double displayed_rmse(double mse);

}  // namespace relign::pixels
