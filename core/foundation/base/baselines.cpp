#include "base/baselines.h"

namespace relign {

std::string baseline_like(std::string_view name) {
  std::string plain;
  for (const char letter : name) {
    const bool sign = letter == ' ' || letter == '.' || letter == '_' || letter == '-';
    if (!sign) plain += letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  }
  for (const char* baseline : kBaselines)
    if (plain == baseline) return baseline;
  return "";
}

}  // namespace relign
