// Distances between images.
#pragma once

#include <cstddef>

namespace relign::images {

// sqrt(mean((a - b)^2)) over `count` values, summed in double in index order.
double rmse(const float* a, const float* b, std::size_t count);

}  // namespace relign::images
