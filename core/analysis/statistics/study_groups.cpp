#include "statistics/study_groups.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace relign::statistics {
namespace {

constexpr std::size_t kMaxInfeasibleListed = 20;

}  // namespace

std::vector<GroupStudy> groups_of(const TrialTable& table) {
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> place;
  std::vector<GroupStudy> groups;
  std::vector<std::size_t> group_of;
  for (std::size_t number = 0; number < table.series.size(); ++number) {
    const Series& series = table.series[number];
    const auto [found, fresh] =
        place.emplace(std::make_tuple(series.scene, series.noise_level, series.protocol), groups.size());
    if (fresh) {
      groups.emplace_back();
      groups.back().scene = series.scene;
      groups.back().noise_level = series.noise_level;
      groups.back().protocol = series.protocol;
    }
    groups[found->second].series.push_back(number);
    group_of.push_back(found->second);
  }
  std::vector<std::vector<std::pair<std::uint64_t, double>>> optima(groups.size());
  for (const TrialRow& row : table.rows) {
    GroupStudy& group = groups[group_of[row.series]];
    group.instances.push_back(row.instance);
    if (!std::isnan(row.own_optimum_mse))
      optima[group_of[row.series]].emplace_back(row.instance, table.series_of(row).score.shown(row.own_optimum_mse));
  }
  for (std::size_t number = 0; number < groups.size(); ++number) {
    std::vector<std::uint64_t>& instances = groups[number].instances;
    std::sort(instances.begin(), instances.end());
    instances.erase(std::unique(instances.begin(), instances.end()), instances.end());
    std::sort(optima[number].begin(), optima[number].end());
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    optima[number].erase(std::unique(optima[number].begin(), optima[number].end(), same), optima[number].end());
    std::vector<double> scores;
    for (const auto& [instance, own] : optima[number]) scores.push_back(own);
    groups[number].own_optimum = quantiles(std::move(scores));
  }
  return groups;
}

void find_further_at_optimum(const TrialTable& table, GroupStudy& group) {
  std::map<std::uint64_t, const std::vector<double>*> of_instance;
  for (const std::size_t number : group.series)
    for (const std::uint32_t place : table.series[number].trials) {
      const TrialRow& row = table.rows[place];
      const std::vector<double>& values = table.criteria_of(row).further_at_optimum;
      if (!values.empty()) of_instance[row.instance] = &values;
    }
  for (std::size_t i = 0; i < kMostFurtherScores; ++i) {
    std::vector<double> values;
    for (const auto& [instance, scores] : of_instance)
      if (i < scores->size()) values.push_back((*scores)[i]);
    if (!values.empty()) group.further_at_optimum.push_back(quantiles(std::move(values)));
  }
}

void find_infeasible(const TrialTable& table, GroupStudy& group, Rule rule) {
  const records::Specification& spec = group.spec;
  if (!spec.limits_anything()) return;
  std::set<std::uint64_t> found, met;
  for (const std::size_t number : group.series)
    for (const std::uint32_t place : table.series[number].trials) {
      const TrialRow& row = table.rows[place];
      const TrialMtf& mtf = table.mtf_of(row);
      const bool has_mtf = !std::isnan(mtf.own_optimum.centre);
      if (table.series[number].score.shown(row.own_optimum_mse) > spec.score ||  // false when one is NaN
          (has_mtf && !spec.mtf_met_by(mtf.own_optimum.centre, mtf.own_optimum.corner)) ||
          table.criteria_of(row).optimum_deficit > spec.limits[Criterion::field_mtf])
        found.insert(row.instance);
      // The pose of lowest score need not have the highest MTF: an instance that some method brought in is feasible.
      if ((spec.limits_mtf() || spec.limits_criteria()) && table.meets(row, spec, rule)) met.insert(row.instance);
    }
  for (const std::uint64_t instance : met) found.erase(instance);
  group.cannot_meet_spec = found.size();
  for (const std::uint64_t instance : found)
    if (group.infeasible.size() < kMaxInfeasibleListed) group.infeasible.push_back(instance);
}

}  // namespace relign::statistics
