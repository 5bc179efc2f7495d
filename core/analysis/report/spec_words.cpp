#include "report/spec_words.h"

#include <cmath>

#include "base/text.h"

namespace relign::report {

static std::string score_words(const records::Specification& spec, const SceneScore& score) {
  constexpr int kDigits = 3;
  return score.name + " " + significant(spec.score, kDigits) + score.suffix();
}

std::string criterion_words(const std::string& name, const records::Specification& spec, const SceneScore& score) {
  constexpr int kDigits = 3;
  if (name == "rmse") return score_words(spec, score);
  if (name == "all") return "all";
  const Criterion one = criterion_named(name);
  const CriterionEntry& entry = entry_of(one);
  if (const FurtherScore* further = score.further_of(one))
    return further->name + " " + significant(spec.limits[one], kDigits) +
           (further->unit.empty() ? "" : " " + further->unit);
  if (one == Criterion::field_mtf)
    return std::string(entry.words) + " at " + significant(spec.field_mtf.lp_per_mm, kDigits) + " lp/mm";
  return std::string(entry.words) + " " + significant(spec.limits[one], kDigits) + std::string(entry.unit);
}

std::string criterion_meaning(const std::string& name) {
  return name == "rmse" || name == "all" ? "" : std::string(entry_of(criterion_named(name)).meaning);
}

static std::string criteria_words(const records::Specification& spec, const SceneScore& score) {
  std::string words;
  for (const Criterion one : kCriteria)
    if (!std::isnan(spec.limits[one]))
      words += (words.empty() ? "" : ", ") + criterion_words(std::string(entry_of(one).column), spec, score);
  return words;
}

std::string spec_words(const records::Specification& spec, const SceneScore& score) {
  constexpr int kSpecDigits = 3;
  std::string words;
  if (std::isfinite(spec.score)) words = score_words(spec, score);
  const std::string judged = criteria_words(spec, score);
  if (!judged.empty()) words += (words.empty() ? "" : ", ") + judged;
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
    const std::string words = spec_words(group.spec, group.scored_by);
    if (words.empty() || (!common.empty() && words != common)) return "";
    common = words;
  }
  if (common.empty()) return "";
  const records::Specification& spec = groups.front().spec;
  const bool by_field = !std::isnan(spec.limits[Criterion::field_mtf]);
  if (!spec.limits_mtf())
    return common + " at the final pose" + (by_field ? std::string("; ") + mtf_kind_words(spec) : "");
  return common + " at the final pose; MTF of the lens, " + mtf_kind(spec) + ", evaluated once at the end";
}

const char* mtf_kind_words(const records::Specification& spec) {
  return spec.diffraction ? "MTF with diffraction" : "geometric MTF (no diffraction)";
}

const char* mtf_kind(const records::Specification& spec) { return spec.diffraction ? "with diffraction" : "geometric"; }

}  // namespace relign::report
