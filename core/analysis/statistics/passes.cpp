#include "statistics/passes.h"

#include <cmath>

namespace relign::statistics {

std::vector<Passes> passes_of(const TrialTable& table, const std::vector<std::size_t>& series,
                              const records::Specification& spec, Rule rule) {
  std::vector<Passes> passes(series.size());
  if (!spec.limits_anything() || (spec.limits_criteria() && rule != Rule::own)) return passes;
  struct Known {
    bool truth = false, mtf = false;
  };
  std::vector<Known> known(series.size());
  std::map<std::uint32_t, std::size_t> place;
  for (std::size_t i = 0; i < series.size(); ++i) place.emplace(static_cast<std::uint32_t>(series[i]), i);
  for (const TrialRow& row : table.rows) {
    const auto found = place.find(row.series);
    if (found == place.end()) continue;
    bool& passed = passes[found->second][row.instance];
    if (!row.counts()) continue;
    const double score = row.last_of(track_of(rule));
    const records::MtfRecord& mtf = table.mtf_of(row).by[rule][Curing::after];
    Known& what = known[found->second];
    what.truth = what.truth || !std::isnan(score);
    what.mtf = what.mtf || !std::isnan(mtf.centre);
    passed = table.meets(row, spec, rule);
  }
  for (std::size_t i = 0; i < passes.size(); ++i)
    if (!known[i].truth || (spec.limits_mtf() && !known[i].mtf)) passes[i].clear();
  return passes;
}

PairedShares compare_passes(const Passes& first, const Passes& second) {
  std::vector<bool> a, b;
  for (const auto& [instance, passed] : first)
    if (const auto other = second.find(instance); other != second.end()) {
      a.push_back(passed);
      b.push_back(other->second);
    }
  return compare_shares(a, b);
}

}  // namespace relign::statistics
