#include "report/compare_yield.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "report/page_data.h"
#include "report/statistics_data.h"

namespace relign::report {
namespace {

records::Specification spec_of(const ComparedSeries& of) {
  const stats::StudyOptions options = study_options(of.results);
  const auto found = options.spec_of_scene.find(of.series.scene);
  return found == options.spec_of_scene.end() ? options.spec : found->second;
}

bool equal(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool equal(const records::Specification& a, const records::Specification& b) {
  return equal(a.rmse, b.rmse) && equal(a.lp_per_mm, b.lp_per_mm) && equal(a.mtf_centre, b.mtf_centre) &&
         equal(a.mtf_corner, b.mtf_corner) && a.diffraction == b.diffraction;
}

// Whether each lens is in specification; empty where nobody can know.
std::map<std::uint64_t, bool> in_spec(const ComparedSeries& of, const records::Specification& spec) {
  const stats::TrialTable& table = of.results.trials;
  std::map<std::uint64_t, bool> lenses;
  bool truth_known = false, mtf_known = !spec.limits_mtf();
  for (const stats::TrialRow& row : table.rows) {
    if (&table.series_of(row) != &of.series) continue;
    bool& passes = lenses[row.instance];
    if (!row.counts()) continue;
    const double rmse = row.last_of(stats::Track::recommended);
    const records::MtfRecord& mtf = table.mtf_of(row).glued;
    truth_known = truth_known || !std::isnan(rmse);
    mtf_known = mtf_known || !std::isnan(mtf.centre);
    passes = spec.met_by(rmse, mtf.centre, mtf.corner);
  }
  return truth_known && mtf_known ? lenses : std::map<std::uint64_t, bool>();
}

}  // namespace

stats::PairedShares compare_yield(const ComparedSeries& a, const ComparedSeries& b) {
  const records::Specification spec = spec_of(a);
  if (!spec.limits_anything() || !equal(spec, spec_of(b))) return {};
  const std::map<std::uint64_t, bool> of_a = in_spec(a, spec), of_b = in_spec(b, spec);
  std::vector<bool> first, second;
  for (const auto& [instance, passes] : of_a)
    if (const auto other = of_b.find(instance); other != of_b.end()) {
      first.push_back(passes);
      second.push_back(other->second);
    }
  return stats::compare_shares(first, second);
}

Json yield_json(const stats::PairedShares& yield) {
  if (yield.n == 0) return nullptr;
  return {{"n", yield.n},
          {"a", yield.first},
          {"b", yield.second},
          {"a_alone", yield.first_alone},
          {"b_alone", yield.second_alone},
          {"p", shown_number(yield.p)}};
}

std::string yield_text(const Json& yield) {
  return "in specification: A " + text_of(yield, "a") + ", B " + text_of(yield, "b") + " of " + text_of(yield, "n") +
         " lenses; with A alone " + text_of(yield, "a_alone") + ", with B alone " + text_of(yield, "b_alone") + ", p " +
         significant(yield["p"].get<double>(), 2);
}

}  // namespace relign::report
