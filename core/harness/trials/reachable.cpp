#include "trials/reachable.h"

#include <cmath>

#include "base/seeds.h"
#include "trials/instance.h"
#include "trials/own_optimum.h"
#include "trials/trial.h"

namespace relign::trials {

bool Reachable::can_meet(const records::Specification& spec) const {
  const auto within = [](double value, double most) { return !(value > most); };  // NaN: unknown, or no limit
  return within(score, spec.score) && within(field_mtf_deficit, spec.limits[Criterion::field_mtf]) &&
         within(spec.mtf_centre, mtf.centre) && within(spec.mtf_corner, mtf.corner);
}

bool limits_reachable(const records::Specification& spec) {
  return !std::isnan(spec.score) || spec.limits_mtf() || !std::isnan(spec.limits[Criterion::field_mtf]);
}

Reachable reachable(plugin_host::MountedAssembly& lens, const SceneFacts& scene, const records::Specification& spec,
                    const FieldValues& design, std::uint64_t seed) {
  Reachable found;
  std::vector<double> pose = scene.nominal_pose;
  // The search for the lowest score renders images: only where it is limited.
  const bool by_images = !std::isnan(spec.score) || spec.limits_mtf();
  if (auto best = by_images ? own_optimum(lens, scene, seed) : std::nullopt) {
    found.score = scene.score.shown(best->mse);
    pose = std::move(best->true_pose);
    if (spec.measures_mtf()) found.mtf = mtf_at(lens, pose, spec.lp_per_mm);
  }
  const Criteria criteria = criteria_of(spec, scene);
  if (const auto best = Judge(lens, scene, criteria, design, seed).optimum(pose))
    found.field_mtf_deficit = best->deficit;
  return found;
}

PossibleYield possible_yield(plugin_host::Scene& scene, const SceneFacts& facts, plugin_host::NoiseLevel& level,
                             const records::Specification& spec, std::uint64_t lenses,
                             const std::function<void(std::uint64_t)>& before_each) {
  const Criteria criteria = criteria_of(spec, facts);
  plugin_host::MountedAssembly perfect = scene.mount("{}");
  const FieldValues design = design_fields(perfect, facts, criteria);
  PossibleYield yield;
  before_each(0);
  yield.design = reachable(perfect, facts, spec, design, 1);
  for (; yield.lenses < lenses; ++yield.lenses) {
    before_each(yield.lenses);
    const Instance drawn = draw_instance(level, facts, 0, SeedDomain::training, yield.lenses);
    plugin_host::MountedAssembly lens = scene.mount(drawn.perturbations.elements_json);
    const std::uint64_t seed = frame_seed(drawn.seed, 0, FrameStream::own_optimum);
    if (reachable(lens, facts, spec, design, seed).can_meet(spec)) ++yield.possible;
  }
  return yield;
}

}  // namespace relign::trials
