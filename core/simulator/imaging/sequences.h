// Binomial thresholds and sample allocation, shared by samplers.
#pragma once

#include <cstdint>
#include <vector>

namespace relign::imaging {

// Distribution function of Binomial(n, p), p < 1, in units of 2^-32: a uniform word that reaches k of the thresholds
// draws k. Returns the number of thresholds; `thresholds` has space for n.
int binomial_thresholds(int n, double p, std::uint32_t* thresholds);

// Divides `total` samples by weights with sum 1: largest remainders, at least one each. `total` must not be smaller
// than the number of weights.
std::vector<int> allocate_samples(int total, const std::vector<double>& weights);

}  // namespace relign::imaging
