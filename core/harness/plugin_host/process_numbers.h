// Numbers in messages to processes: the shortest decimals that read back as the same double, null for non-finite
// numbers, independent of the locale. Faster than a JSON library: a step should cost microseconds.
#pragma once

#include <cstddef>
#include <string>

namespace relign::plugin_host {

void append_number(std::string& text, double value);
void append_numbers(std::string& text, const double* values, std::size_t count);  // "[1,0.5]"

}  // namespace relign::plugin_host
