// Sample allocation, shared by samplers.
#pragma once

#include <vector>

namespace relign::imaging {

// Divides `total` samples by weights with sum 1: largest remainders, at least one each. `total` must not be smaller
// than the number of weights.
std::vector<int> allocate_samples(int total, const std::vector<double>& weights);

}  // namespace relign::imaging
