// Synthetic statistics in the model of a page, for tests of their presentation.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "report/page_model.h"

namespace relign::report {

inline void make_row(Row& row, double rank) {
  const double share = std::max(0.02, 1.05 - 0.25 * rank), median = row.recommended.median;
  row.recommended.interval = {0.8 * median, 1.3 * median};
  const auto in = static_cast<std::size_t>(10 * share);
  row.yield = {{in, 10, share, {share * 0.8, 1 - 0.6 * (1 - share)}}, std::nullopt};
  row.to_spec = {in, 10, 3 + 4 * rank, 4 * rank, 0.4 * rank, {2 + 4 * rank, 6 + 4 * rank}};
  if (share < 0.5) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    row.to_spec->steps = row.to_spec->seconds = kNever;
    row.to_spec->interval = {kNever, kNever};
  }
  row.residual.clear();
  for (const char* axis : {"x", "y", "z"})
    row.residual.push_back({axis, "mm", 0.0008 * rank * (axis[0] - 'w'), 0.003 * rank});
  for (const char* axis : {"Rx", "Ry"}) row.residual.push_back({axis, "deg", 0.01 * rank, 0.04 * rank});
}

inline Ecdf made_ecdf(const std::string& method, double rank) {
  Ecdf ecdf = {method, {}};
  for (std::size_t step = 0; step <= 30; step += step < 8 ? 1 : 3)
    ecdf.points.emplace_back(
        step, std::max(0.02, 1.05 - 0.25 * rank) * (1 - std::exp(-static_cast<double>(step) / (3.0 * rank))));
  return ecdf;
}

inline void make_curve(Curve& curve) {
  std::size_t count = 0;
  for (CurveTrack& track : curve.tracks) {
    if (track.median.empty()) continue;
    count = track.median.size();
    track.low.assign(count, kMissing);
    track.high.assign(count, kMissing);
    for (std::size_t i = 0; i < count; ++i)
      if (i < 8 || i % 5 == 0 || i + 1 == count) {
        track.low[i] = 0.8 * track.median[i];
        track.high[i] = 1.3 * track.median[i];
      }
  }
  curve.machine_seconds.clear();
  curve.algorithm_seconds.clear();
  const double pace = 0.08 + 0.01 * static_cast<double>(curve.method.size());
  for (std::size_t i = 0; i < count; ++i) {
    curve.machine_seconds.push_back(pace * static_cast<double>(i));
    curve.algorithm_seconds.push_back(0.001 * pace * static_cast<double>(i));
  }
}

inline PageModel with_statistics(PageModel page) {
  page.targets = {0.1, 0.05, 0.02, 0.01};
  page.spec_text = "RMSE 0.0142 at the final pose";
  page.gates = {{"A/A", true, "A/A"}, {"replay", true, "replay 10/10"}};
  for (Group& group : page.groups) {
    group.spec.score = 0.0142;
    group.own_optimum = 0.0018;
    group.next_image = 0.0031;
    group.ecdf.clear();
    group.pairs.clear();
    for (std::size_t a = 0; a < group.rows.size(); ++a) {
      const double rank = static_cast<double>(a) + 1;
      make_row(group.rows[a], rank);
      group.ecdf.push_back(made_ecdf(group.rows[a].method, rank));
      for (std::size_t b = a + 1; b < group.rows.size(); ++b) {
        Pair pair;
        pair.a = group.rows[a].method;
        pair.b = group.rows[b].method;
        pair.n = 10;
        pair.ratio = 0.7;
        pair.interval = {0.5, 0.95};
        pair.improvement = 0.8;
        pair.p = 0.012;
        pair.p_holm = 0.07;
        pair.verdict = a == 0 ? statistics::Verdict::better : statistics::Verdict::undecided;
        group.pairs.push_back(pair);
      }
    }
    for (Curve& curve : group.curves) make_curve(curve);
  }
  if (page.methods.empty()) return page;
  TrainingCost cost = {page.methods[0].name, 0.45, 12000, true, "a laptop of four cores", {}};
  for (std::size_t group = 0; group < page.groups.size(); ++group)
    cost.pays_after.push_back({group, page.groups[group].label, 740, "slow", 2.19});
  page.training = {cost};
  return page;
}

}  // namespace relign::report
