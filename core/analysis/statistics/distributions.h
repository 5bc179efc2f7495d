// Distribution functions for intervals and tests, from Boost.Math, which only distributions.cpp includes.
//
// A NaN argument gives NaN. Throws Error (internal) for degrees of freedom that are not positive and for probabilities
// outside [0, 1].
#pragma once

#include <cstddef>

namespace relign::statistics {

double normal_lower(double z);               // P(Z <= z)
double normal_quantile(double probability);  // z with P(Z <= z) = probability; infinite at 0 and 1
double student_t_quantile(double probability, double degrees);
double chi_squared_upper(double value, double degrees);                     // P(X > value); 1 for value <= 0
double fisher_f_upper(double value, double numerator, double denominator);  // P(F > value), degrees of freedom

// Binomial CDF with p = 1/2: P(at most `heads` heads in `throws` throws); 1 without throws.
double fair_coin_lower(std::size_t heads, std::size_t throws);

// Throws Error (bad_input) unless 0 < confidence < 1.
void check_confidence(double confidence);

}  // namespace relign::statistics
