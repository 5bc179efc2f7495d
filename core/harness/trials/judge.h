// Judges the criteria of a specification (base/criteria.h) after every step. Noise-free: from the rays of the lens as
// built (the ability "fields"), so that a step costs milliseconds and no image is rendered.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "base/criteria.h"
#include "plugin_host/objects.h"
#include "records/specification.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// What is to be judged on one scene.
struct Criteria {
  struct FieldLimit {
    std::uint32_t field = 0;                                                              // of SceneFacts::fields
    double tangential = std::numeric_limits<double>::quiet_NaN(), sagittal = tangential;  // at least; NaN: no limit
  };
  double lp_per_mm = 1;  // any, for places alone
  std::vector<FieldLimit> field_mtf;
  ByCriterion<bool> judged = {};

  bool any() const;
  bool needs(CriterionNeeds what) const;
};
// Those that the specification limits, and the further scores of the scene. Throws Error(bad_input) for a field that
// the scene does not have.
Criteria criteria_of(const records::Specification& spec, const SceneFacts& scene);

using FieldValues = std::vector<plugin_host::MountedAssembly::FieldValues>;

// Calls body(least, field, MTF: a member of its values) for each limit of MTF by field, in their order.
template <class Body>
void for_each_limit(const Criteria& criteria, const Body& body) {
  using Values = FieldValues::value_type;
  for (const Criteria::FieldLimit& limit : criteria.field_mtf) {
    if (!std::isnan(limit.tangential)) body(limit.tangential, limit.field, &Values::tangential);
    if (!std::isnan(limit.sagittal)) body(limit.sagittal, limit.field, &Values::sagittal);
  }
}

// All fields of a lens; throws Error(bad_input) if its scene does not measure them.
FieldValues measure_fields(plugin_host::MountedAssembly& lens, const SceneFacts& scene, double lp_per_mm,
                           const std::vector<double>& true_pose);
// Those of the perfect lens at the nominal pose; empty if the criteria need none.
FieldValues design_fields(plugin_host::MountedAssembly& perfect, const SceneFacts& scene, const Criteria& criteria);

// How an image lies against the design's, over the fields that both show. NaN without a field, or with one for the
// rotation.
struct FieldShift {
  double x_px = kUnknown, y_px = kUnknown, rotation = kUnknown;  // radians
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
};
FieldShift shift_of(const FieldValues& fields, const FieldValues& design);

// Judges poses of one lens.
class Judge {
 public:
  // All arguments must outlive it. design: of the perfect lens at the nominal pose; empty if the criteria need no
  // fields. seed: of the further scores.
  Judge(plugin_host::MountedAssembly& lens, const SceneFacts& scene, const Criteria& criteria,
        const FieldValues& design, std::uint64_t seed)
      : lens_(lens), scene_(scene), criteria_(criteria), design_(design), seed_(seed) {}

  struct Optimum {
    std::vector<double> true_pose;
    double deficit = 0;
  };
  // The lens's own optimum under a limit of MTF by field (criterion_optimum.h). Nothing without such a limit.
  std::optional<Optimum> optimum(const std::vector<double>& start);

  // own_optimum: empty if unknown. Each pose is measured once. Values that are not wanted, or that no light determines,
  // are NaN. Throws Error(plugin_failed) for a further score that is declared and not offered, or below 0.
  ByCriterion<double> at(const std::vector<double>& true_pose, const std::vector<double>& own_optimum);

 private:
  const FieldValues& fields_at(const std::vector<double>& true_pose);
  const std::vector<double>& further_scores_at(const std::vector<double>& true_pose);
  std::vector<double> deficits(const FieldValues& fields) const;
  plugin_host::MountedAssembly& lens_;
  const SceneFacts& scene_;
  const Criteria& criteria_;
  const FieldValues& design_;
  std::uint64_t seed_;
  std::map<std::vector<double>, FieldValues> known_;
  std::map<std::vector<double>, std::vector<double>> known_further_;  // scores, in the scene's order
};

}  // namespace relign::trials
