// Distribution functions that intervals and tests need. From Boost.Math, which only distributions.cpp includes.
//
// A NaN argument gives NaN. Degrees of freedom are positive, probabilities in [0, 1]; anything else throws Error
// (internal): a rule of the caller's was broken.
#pragma once

#include <cstddef>

namespace relign::statistics {

double normal_lower(double z);               // P(Z <= z)
double normal_quantile(double probability);  // z with P(Z <= z) = probability; infinite at 0 and 1
double student_t_quantile(double probability, double degrees);
double chi_squared_upper(double value, double degrees);                     // P(X > value); 1 for value <= 0
double fisher_f_upper(double value, double numerator, double denominator);  // P(F > value), degrees of freedom

// P(at most so many heads of so many throws); 1 of no throw.
double fair_coin_lower(std::size_t heads, std::size_t throws);

}  // namespace relign::statistics
