#include "runner/merits.h"

#include "base/error.h"
#include "suites/plan.h"
#include "trials/field_merit.h"

namespace relign::runner {

trials::MtfLimits limits_of(const records::Specification& spec) {
  return {spec.lp_per_mm, spec.mtf_centre, spec.mtf_corner};
}

void check_merits(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts) {
  std::string mistakes;
  for (const trials::SceneFacts& scene : facts)
    for (const suites::AlgorithmEntry& algorithm : suite.algorithms) {
      const auto merit = trials::merit_from_name(suites::effective_merit(algorithm));
      if (!merit) throw Error(ErrorKind::internal, "unknown merit '" + algorithm.merit + "' in a suite");
      const trials::MtfLimits limits = limits_of(records::specification_of(suite.spec, scene.spec, scene.score));
      if (const std::string mistake = trials::field_merit_mistake(*merit, limits, scene); !mistake.empty())
        mistakes += (mistakes.empty() ? "'" : "\n'") + algorithm.name + "': " + mistake;
    }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
}

}  // namespace relign::runner
