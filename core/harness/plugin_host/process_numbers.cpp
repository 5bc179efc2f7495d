#include "plugin_host/process_numbers.h"

#include <cmath>

#include "base/text.h"

namespace relign::plugin_host {

void append_number(std::string& text, double value) { text += std::isfinite(value) ? shortest(value) : "null"; }

void append_numbers(std::string& text, const double* values, std::size_t count) {
  text += '[';
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) text += ',';
    append_number(text, values[i]);
  }
  text += ']';
}

}  // namespace relign::plugin_host
