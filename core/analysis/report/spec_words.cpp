#include "report/spec_words.h"

#include "base/text.h"

namespace relign::report {

std::string spec_words(const records::Specification& spec) {
  constexpr int kSpecDigits = 3;
  std::string words;
  if (std::isfinite(spec.rmse)) words = "RMSE " + significant(spec.rmse, kSpecDigits);
  if (!spec.limits_mtf()) return words;
  const bool centre = std::isfinite(spec.mtf_centre), corner = std::isfinite(spec.mtf_corner);
  words += (words.empty() ? "MTF at " : ", MTF at ") + significant(spec.lp_per_mm, kSpecDigits) + " lp/mm ";
  if (centre) words += significant(spec.mtf_centre, kSpecDigits) + " in the centre";
  if (corner) words += (centre ? " and " : "") + significant(spec.mtf_corner, kSpecDigits) + " in the corners";
  return words;
}

std::string spec_sentence(const std::vector<Group>& groups) {
  std::string common;
  for (const Group& group : groups) {
    const std::string words = spec_words(group.spec);
    if (words.empty() || (!common.empty() && words != common)) return "";
    common = words;
  }
  if (common.empty()) return "";
  const records::Specification& spec = groups.front().spec;
  if (!spec.limits_mtf()) return common + " at the final pose";
  return common + " at the final pose; MTF of the lens, " + mtf_kind(spec) + ", evaluated once at the end";
}

const char* mtf_kind(const records::Specification& spec) {
  return spec.measures_mtf() && spec.diffraction ? "with diffraction" : "geometric";
}

}  // namespace relign::report
