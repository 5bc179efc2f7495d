#include "report/spec_words.h"

#include "base/json_members.h"
#include "base/text.h"

namespace relign::report {
namespace {

constexpr int kSpecDigits = 3;

std::string number_text_of(const Json& object, const char* key) {
  const Json value = object.value(key, Json());
  return value.is_number() ? significant(value.get<double>(), kSpecDigits) : "";
}

}  // namespace

std::string spec_words(const Json& group) {
  std::string words;
  if (const std::string rmse = number_text_of(group, "spec_rmse"); !rmse.empty()) words = "RMSE " + rmse;
  const Json& mtf = object_of(group, "spec_mtf");
  const std::string centre = number_text_of(mtf, "centre"), corner = number_text_of(mtf, "corner");
  if (centre.empty() && corner.empty()) return words;
  words += (words.empty() ? "MTF at " : ", MTF at ") + number_text_of(mtf, "lp_per_mm") + " lp/mm ";
  if (!centre.empty()) words += centre + " in the centre";
  if (!corner.empty()) words += (centre.empty() ? "" : " and ") + corner + " in the corners";
  return words;
}

std::string spec_sentence(const Json& groups) {
  std::string common;
  for (const Json& group : groups) {
    const std::string words = spec_words(group);
    if (words.empty() || (!common.empty() && words != common)) return "";
    common = words;
  }
  if (common.empty()) return "";
  if (!judges_mtf(groups.front())) return common + " at the final pose";
  return common + " at the final pose; MTF of the lens, " + mtf_kind(groups.front()) + ", evaluated once at the end";
}

std::string mtf_kind(const Json& group) {
  return flag_of(object_of(group, "spec_mtf"), "diffraction") ? "with diffraction" : "geometric";
}

bool judges_mtf(const Json& group) {
  const Json& mtf = object_of(group, "spec_mtf");
  return mtf.contains("centre") || mtf.contains("corner");
}

}  // namespace relign::report
