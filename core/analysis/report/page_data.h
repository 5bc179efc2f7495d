// The data behind the page as one JSON value: the HTML sections, the scripts and `report --format json` use it and
// nothing else. Pictures are separate (pictures.h).
//
// {suite_name, suite_file, suite_text, seed, command, scenes, noise_levels, protocols, steps [least, most], instances,
// ran {planned, finished, failed, missing, incomplete, from_other_plans}, methods [...], groups [...], verdict, beware
// [caveats], failures, warnings, program, machine, of a merged folder sources [{folder, trials, cpu, program}] and
// merge}. A group has comparable results, of one scene, noise level and protocol: {scene, noise_level, protocol, label,
// instances, same_instances, start, rows, curves, measured_only and station (if true)}.
//
// From the statistics; absent or null if not available:
//   targets        RMSE levels of the suite, descending; spec {rmse, mtf} of the suite; spec_text, a sentence, if all
//                  groups have the same specification
//   group.spec_rmse, group.spec_mtf {lp_per_mm, centre, corner, diffraction}: the specification of the group
//   group.cannot_meet_spec, group.infeasible: number of infeasible instances, and the first of them
//   gates          [{name, ok, text}] (gates.h)
//   group.floor    {own_optimum, next_image}: median RMSE at the instances' own optima; Cramer-Rao bound of one more
//   image group.rows[i]  recommended, commanded {n, median, q25, q75, lo95, hi95, iqm, iqm_lo95, iqm_hi95}; yield {in,
//   n,
//                  share, lo95, hi95, uncured {the same before curing}}; mtf {centre, corner {n, median, q25, q75}};
//                  to_spec {successes, n, steps, lo95, hi95, expected, seconds}; residual {axes [{name, unit, median,
//                  q75}]}: absolute distance of the recommended pose from the own optimum
//   group.curves[i].tracks[t]  also lo95, hi95, null where not computed; curves[i].machine_seconds and
//                  .algorithm_seconds: median time of each step
//   group.ecdf     [{method, steps [], share []}]: runtime ECDF over (instance, target) pairs
//   group.pairs    [{a, b, n, ratio, lo95, hi95, improvement, p, p_holm, verdict, reason}]: a compared with b; reason
//   if
//                  undecided; for planned contrasts also planned, p_planned, and with a specification yields {n, a, b,
//                  a_alone, b_alone, p, p_planned}
//   rule           "own", "best" or "current": the rule behind everything named recommended, yield, to_spec, ecdf,
//   pairs group.rows[i].rules, group.rules: results by each rule, and rules_note, a sentence (rules_data.h) analysis
//   the analysis plan, and analysis_notes, sentences (rules_data.h) training       [{method, hours, steps, machine,
//   pays_after [{group, label, lenses, against, saves}]}]: group is an
//                  index into groups; lenses the break-even number, "never" or null; saves seconds per lens compared
//                  with the fastest method without training
//   aggregate      aggregates over all scenes and noise levels (aggregate_data.h)
//   scene_facts    facts of each scene (scene_data.h)
// Of folders merged for this page only: merged_for_this_page, and merge_notes, sentences.
// Of folders with different instance sets: parts (several_folders.h); scenes and labels start with the folder's name.
#pragma once

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

Json page_data(const LoadedResults& results, const statistics::Study& study);
Json page_data(const LoadedResults& results);  // computes the study

// The label of a method in data["methods"], by its name in the rows of groups with this protocol; the name if unknown.
std::string label_of(const Json& methods, const std::string& name, const std::string& protocol);

// The error that ranks a row, {n, median, q25, q75}: at the recommended pose, or the lowest measured one without ground
// truth ("measured_only" of the group).
const Json& score_of(const Json& row);

// Significant digits, so that the data agree with the tables to 1e-9.
inline constexpr int kDataDigits = 10;

// `value` with that many significant digits.
double rounded(double value, int digits);

// A number of an object or a list; NaN if absent or not a number.
double number_in(const Json& object, const char* key);
double number_in(const Json& list, std::size_t at);

// Rounded to kDataDigits; null if not finite.
Json shown_number(double value);

}  // namespace relign::report
