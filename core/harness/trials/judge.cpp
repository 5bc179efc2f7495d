#include "trials/judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "trials/criterion_optimum.h"

namespace relign::trials {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// What a criterion is judged by.
struct PoseFacts {
  const SceneFacts& scene;
  const std::vector<double>& true_pose;
  const std::vector<double>& own_optimum;  // true pose; empty if unknown
  const FieldValues& design;               // of the perfect lens at the nominal pose
  const FieldValues* fields = nullptr;  // at this pose; null, and what follows unknown, where no criterion needs them
  std::vector<double> deficits = {};    // limit - MTF, of all fields and directions with a limit
  FieldShift shift = {};                // of the fields' image against the design's
};

// Distance from the own optimum over the observable axes of this unit, Euclidean.
double distance(const PoseFacts& at, std::string_view unit) {
  if (at.own_optimum.empty()) return kNaN;
  double squares = 0;
  for (std::size_t i = 0; i < at.scene.axes.size(); ++i) {
    const Axis& axis = at.scene.axes[i];
    if (!axis.observable || axis.unit != unit) continue;
    const double away = (at.true_pose[i] - at.own_optimum[i]) * axis.travel();
    squares += away * away;
  }
  return std::sqrt(squares);
}

struct JudgedCriterion {
  std::string_view column;  // as in kCriterionEntries
  double (*value)(const PoseFacts&);
};
constexpr std::array kJudged = {
    JudgedCriterion{"field_mtf_deficit",
                    [](const PoseFacts& at) {
                      return at.deficits.empty() ? kNaN : *std::max_element(at.deficits.begin(), at.deficits.end());
                    }},
    JudgedCriterion{
        "centre_px",
        [](const PoseFacts& at) { return std::sqrt(at.shift.x_px * at.shift.x_px + at.shift.y_px * at.shift.y_px); }},
    JudgedCriterion{"rotation_px",
                    [](const PoseFacts& at) {
                      const double width = at.scene.image_width, height = at.scene.image_height;
                      return std::fabs(at.shift.rotation) * std::sqrt(width * width + height * height) / 2;
                    }},
    JudgedCriterion{"pose_um", [](const PoseFacts& at) { return 1000 * distance(at, "mm"); }},
    JudgedCriterion{"tilt_arcmin", [](const PoseFacts& at) { return 60 * distance(at, "deg"); }},
};
static_assert(std::equal(kJudged.begin(), kJudged.end(), kCriterionEntries.begin(),
                         kCriterionEntries.end() - kMostFurtherScores,
                         [](const JudgedCriterion& judged, const CriterionEntry& entry) {
                           return judged.column == entry.column;
                         }),
              "every entry of kCriterionEntries needs its function here, in the same order; the scene has those of "
              "further scores");

}  // namespace

bool Criteria::any() const {
  return std::any_of(kCriteria.begin(), kCriteria.end(), [&](Criterion one) { return judged[one]; });
}

bool Criteria::needs(CriterionNeeds what) const {
  return std::any_of(kCriteria.begin(), kCriteria.end(),
                     [&](Criterion one) { return judged[one] && entry_of(one).needs == what; });
}

Criteria criteria_of(const records::Specification& spec, const SceneFacts& scene) {
  Criteria criteria;
  for (const Criterion one : kCriteria) criteria.judged[one] = !std::isnan(spec.limits[one]);
  for (std::size_t i = 0; i < scene.score.further.size(); ++i) criteria.judged[further_score(i)] = true;
  if (!criteria.judged[Criterion::field_mtf]) return criteria;
  criteria.lp_per_mm = spec.field_mtf.lp_per_mm;
  std::vector<std::string> names;
  for (const images::EdgeField& field : scene.fields) names.push_back(field.name);
  if (spec.field_mtf.fields.empty())
    for (std::uint32_t i = 0; i < names.size(); ++i)
      criteria.field_mtf.push_back({i, spec.field_mtf.every.tangential, spec.field_mtf.every.sagittal});
  for (const records::FieldLimits& limits : spec.field_mtf.fields) {
    const auto found = std::find(names.begin(), names.end(), limits.name);
    if (found == names.end())
      throw Error(ErrorKind::bad_input, "the specification's 'field_mtf' has the unknown field '" + limits.name +
                                            "'; fields of the scene '" + scene.name + "': " + join(names, ", "));
    criteria.field_mtf.push_back(
        {static_cast<std::uint32_t>(found - names.begin()), limits.tangential, limits.sagittal});
  }
  return criteria;
}

FieldValues measure_fields(plugin_host::MountedAssembly& lens, const SceneFacts& scene, double lp_per_mm,
                           const std::vector<double>& true_pose) {
  std::vector<std::uint32_t> which(scene.fields.size());
  std::iota(which.begin(), which.end(), 0U);
  FieldValues values = lens.fields(true_pose, lp_per_mm, which);
  if (values.empty())
    throw Error(ErrorKind::bad_input, "the scene '" + scene.name + "' does not offer " RELIGN_SCENE_FIELDS);
  return values;
}

FieldValues design_fields(plugin_host::MountedAssembly& perfect, const SceneFacts& scene, const Criteria& criteria) {
  if (!criteria.needs(CriterionNeeds::fields)) return {};
  return measure_fields(perfect, scene, criteria.lp_per_mm, scene.nominal_pose);
}

FieldShift shift_of(const FieldValues& fields, const FieldValues& design) {
  double n = 0, x = 0, y = 0, from_x = 0, from_y = 0;
  const auto each = [&](const auto& body) {
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (!std::isnan(fields[i].x_px) && !std::isnan(design[i].x_px))
        body(design[i].x_px, design[i].y_px, fields[i].x_px - design[i].x_px, fields[i].y_px - design[i].y_px);
  };
  each([&](double at_x, double at_y, double dx, double dy) {
    n += 1;
    x += dx;
    y += dy;
    from_x += at_x;
    from_y += at_y;
  });
  double moment = 0, inertia = 0;
  each([&](double at_x, double at_y, double dx, double dy) {
    const double u = at_x - from_x / n, v = at_y - from_y / n;
    moment += u * (dy - y / n) - v * (dx - x / n);
    inertia += u * u + v * v;
  });
  return {x / n, y / n, moment / inertia};  // NaN without a field, or with one for the rotation
}

const FieldValues& Judge::fields_at(const std::vector<double>& true_pose) {
  auto found = known_.find(true_pose);
  if (found == known_.end())
    found = known_.emplace(true_pose, measure_fields(lens_, scene_, criteria_.lp_per_mm, true_pose)).first;
  return found->second;
}

const std::vector<double>& Judge::further_scores_at(const std::vector<double>& true_pose) {
  std::vector<double>& found = known_further_[true_pose];
  for (std::size_t i = found.size(); i < scene_.score.further.size(); ++i) {
    const std::string name =
        "the scene '" + scene_.name + "' declares the further score '" + scene_.score.further[i].name + "', but ";
    std::optional<double> value;
    try {
      value = lens_.further_score(true_pose, seed_, static_cast<std::uint32_t>(i));
    } catch (const Error& error) {
      throw Error(error.kind(), name + "measuring it failed: " + error.what());
    }
    if (!value)
      throw Error(ErrorKind::plugin_failed, name + "its assembly gives none (" RELIGN_SCENE_FURTHER_SCORE
                                                   "; in Python further_score is missing, or returned None)");
    if (*value < 0) throw Error(ErrorKind::plugin_failed, name + "returned " + shortest(*value) + "; it is from 0");
    found.push_back(*value);
  }
  return found;
}

std::vector<double> Judge::deficits(const FieldValues& fields) const {
  std::vector<double> all;
  for_each_limit(criteria_, [&](double least, auto field, auto mtf) { all.push_back(least - fields[field].*mtf); });
  return all;
}

ByCriterion<double> Judge::at(const std::vector<double>& true_pose, const std::vector<double>& own_optimum) {
  PoseFacts facts{scene_, true_pose, own_optimum, design_};
  if (criteria_.needs(CriterionNeeds::fields)) {
    facts.fields = &fields_at(true_pose);
    facts.deficits = deficits(*facts.fields);
    facts.shift = shift_of(*facts.fields, design_);
  }
  ByCriterion<double> values = records::Specification::none();
  for (const Criterion one : kCriteria)
    if (criteria_.judged[one] && !is_further_score(one))
      values[one] = kJudged[static_cast<std::size_t>(one)].value(facts);
  for (std::size_t i = 0; i < scene_.score.further.size(); ++i)
    values[further_score(i)] = further_scores_at(true_pose)[i];
  return values;
}

std::optional<Judge::Optimum> Judge::optimum(const std::vector<double>& start) {
  if (criteria_.field_mtf.empty()) return std::nullopt;
  const auto measure = [this](const std::vector<double>& pose) {
    return measure_fields(lens_, scene_, criteria_.lp_per_mm, pose);
  };
  return criterion_optimum(measure, scene_, criteria_, design_, start);
}

}  // namespace relign::trials
