// Whether lenses can meet a specification at all, by whatever method: judged at their own best poses. Before a run.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "plugin_host/objects.h"
#include "records/record.h"
#include "records/specification.h"
#include "trials/judge.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// What one lens reaches. NaN: not limited, or unknown.
struct Reachable {
  double score = std::numeric_limits<double>::quiet_NaN();  // lowest, as the scene shows it
  records::MtfRecord mtf;                                   // at the same pose
  double field_mtf_deficit = score;                         // at the pose where it is lowest (Judge::optimum)

  // False only where no pose meets the limits of score and MTF; what is unknown and those of places are not considered.
  bool can_meet(const records::Specification& spec) const;
};

// Whether the specification has such limits.
bool limits_reachable(const records::Specification& spec);

// `design`: fields of the perfect lens at the nominal pose; may be empty without limits of MTF by field. Throws Error
// as the scene does.
Reachable reachable(plugin_host::MountedAssembly& lens, const SceneFacts& scene, const records::Specification& spec,
                    const FieldValues& design, std::uint64_t seed);

struct PossibleYield {
  Reachable design;
  std::uint64_t lenses = 0, possible = 0;
};
// Of the design and of `lenses` lenses of a noise level, none of them an instance of a benchmark. `before_each` is
// called with the number of lenses done. Throws Error as scene, level and `before_each` do.
PossibleYield possible_yield(plugin_host::Scene& scene, const SceneFacts& facts, plugin_host::NoiseLevel& level,
                             const records::Specification& spec, std::uint64_t lenses,
                             const std::function<void(std::uint64_t)>& before_each);

}  // namespace relign::trials
