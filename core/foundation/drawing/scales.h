// Round steps of axes and scale bars, and the texts of their numbers.
#pragma once

#include <string>
#include <vector>

namespace relign::drawing {

// The largest of 1, 2, 5 times a power of ten that is at most `value`; value > 0.
double round_step(double value);

// Multiples of a round step from low to high, about `count` of them.
std::vector<double> ticks(double low, double high, int count);

// A multiple of a round step, with as many decimals as the step needs.
std::string tick_text(double value, double step);

}  // namespace relign::drawing
