#include "report/compare_yield.h"

#include <cmath>

#include "report/statistics_data.h"
#include "statistics/passes.h"

namespace relign::report {
namespace {

records::Specification spec_of(const ComparedSeries& of) {
  const statistics::StudyOptions options = study_options(of.results, statistics::Rule::own);
  const auto found = options.spec_of_scene.find(of.series.scene);
  return found == options.spec_of_scene.end() ? options.spec : found->second;
}

bool equal(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool equal(const records::Specification& a, const records::Specification& b) {
  return equal(a.rmse, b.rmse) && equal(a.lp_per_mm, b.lp_per_mm) && equal(a.mtf_centre, b.mtf_centre) &&
         equal(a.mtf_corner, b.mtf_corner) && a.diffraction == b.diffraction;
}

statistics::Passes passes_of(const ComparedSeries& of, const records::Specification& spec, statistics::Rule rule) {
  const auto place = static_cast<std::size_t>(&of.series - of.results.trials.series.data());
  return statistics::passes_of(of.results.trials, {place}, spec, rule).front();
}

}  // namespace

statistics::PairedShares compare_yield(const ComparedSeries& a, const ComparedSeries& b, statistics::Rule rule) {
  const records::Specification spec = spec_of(a);
  if (!spec.limits_anything() || !equal(spec, spec_of(b))) return {};
  return statistics::compare_passes(passes_of(a, spec, rule), passes_of(b, spec, rule));
}

}  // namespace relign::report
