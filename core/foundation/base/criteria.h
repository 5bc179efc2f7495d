// The criteria of a specification that are judged after every step, noise-free, where the recommendation leaves the
// lens after curing. Each has a value per step, and a limit that the value must not exceed.
//
// A new criterion is a line of kCriterionEntries and its function in trials/judge.cpp. Readers of suites and scenes,
// trial ids, records, tables, page, schemas and documents follow from the line (CONTRIBUTING.md).
//
// The last entries are the further scores that a scene declares (base/scene_score.h), in its order. They are judged
// whether they are limited or not, and a "spec" limits them by their names in the scene.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "base/by.h"
#include "base/error.h"

namespace relign {

enum class CriterionNeeds { fields, own_optimum, further_scores };  // of the scene, besides ground truth

struct CriterionEntry {
  std::string_view key;     // of its limit in a "spec", a number from 0 on; but see Criterion::field_mtf; empty: none
  std::string_view column;  // of its values in records and tables
  CriterionNeeds needs;
  std::string_view words, unit;  // of a page; the unit follows a number
  std::string_view meaning;
};
inline constexpr std::array kCriterionEntries = {
    CriterionEntry{"field_mtf", "field_mtf_deficit", CriterionNeeds::fields, "MTF by field", "",
                   "by how much the worst field and direction is below its limit; negative: above"},
    CriterionEntry{"centre_px", "centre_px", CriterionNeeds::fields, "optical centre", " px",
                   "shift of the fields' image from the design's"},
    CriterionEntry{"rotation_px", "rotation_px", CriterionNeeds::fields, "rotation", " px",
                   "rotation of the fields' image times half of the diagonal"},
    CriterionEntry{"pose_um", "pose_um", CriterionNeeds::own_optimum, "position", " \u00b5m",
                   "distance from the instance's optimum, over the observable shifts"},
    CriterionEntry{"tilt_arcmin", "tilt_arcmin", CriterionNeeds::own_optimum, "tilt", "\u2032",
                   "tilt against the instance's optimum, over the observable rotations"},
    CriterionEntry{"", "further_score_1", CriterionNeeds::further_scores, "", "", "the scene's first further score"},
    CriterionEntry{"", "further_score_2", CriterionNeeds::further_scores, "", "", "the scene's second further score"},
    CriterionEntry{"", "further_score_3", CriterionNeeds::further_scores, "", "", "the scene's third further score"},
    CriterionEntry{"", "further_score_4", CriterionNeeds::further_scores, "", "", "the scene's fourth further score"},
};
inline constexpr std::size_t kMostFurtherScores = 4;

// A place in kCriterionEntries. One has a name, because its limit is not a number: an object with limits for each
// field, while the limit of the deficit is 0.
enum class Criterion : std::size_t { field_mtf = 0 };
inline constexpr auto kCriteria = [] {
  std::array<Criterion, kCriterionEntries.size()> all = {};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Criterion>(i);
  return all;
}();
inline constexpr const CriterionEntry& entry_of(Criterion criterion) {
  return kCriterionEntries[static_cast<std::size_t>(criterion)];
}
inline constexpr bool is_further_score(Criterion criterion) {
  return entry_of(criterion).needs == CriterionNeeds::further_scores;
}
// place: from 0, below kMostFurtherScores.
inline constexpr Criterion further_score(std::size_t place) {
  return static_cast<Criterion>(kCriterionEntries.size() - kMostFurtherScores + place);
}
inline constexpr Criterion criterion_named(std::string_view column) {
  for (const Criterion one : kCriteria)
    if (entry_of(one).column == column) return one;
  throw Error(ErrorKind::internal, "no criterion '" + std::string(column) + "'");
}

template <class Value>
using ByCriterion = By<Criterion, kCriteria.size(), Value>;

}  // namespace relign
