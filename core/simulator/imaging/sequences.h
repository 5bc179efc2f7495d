// Numbers that samplers share.
#pragma once

#include <cstdint>
#include <vector>

namespace relign::imaging {

// Kronecker sequence of the generalised golden ratio in four dimensions, as 32-bit fractions: powers of
// 1 / 1.16730397826141868..., the root of x^5 = x + 1.
inline constexpr std::uint32_t kLatticeSteps[4] = {3679390609U, 3152041523U, 2700274805U, 2313257605U};

// Distribution function of Binomial(n, p), p < 1, in units of 2^-32: a uniform word that reaches k of the returned
// number of thresholds stands for k. `thresholds` has room for n.
int binomial_thresholds(int n, double p, std::uint32_t* thresholds);

// `total` samples shared out by weights whose sum is 1: by the largest remainders, at least one each. `total` is not
// smaller than the number of weights.
std::vector<int> shared_out(int total, const std::vector<double>& weights);

}  // namespace relign::imaging
