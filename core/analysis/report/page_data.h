// Everything the page says in words and numbers, as one JSON value: the HTML sections, the script
// that draws the curves and the golden test all read this and nothing else. Pictures stand apart.
//
// Shape: {suite_name, suite_file, suite_text, seed, command, scenes, noise_levels, protocols, steps [least, most],
// instances, ran {planned, finished, failed, missing, incomplete, from_other_plans}, methods [...], groups [...],
// verdict, beware, failures, warnings, program, machine, of a merged folder sources [{folder, trials, cpu, program}]
// and merge}. A group is what can be compared, one scene, noise level and protocol: {scene, noise_level, protocol,
// label, instances, same_instances, start, rows, curves, measured_only and station (when true)}.
//
// What the statistics add; a member that cannot be had is absent or null, and its part of the page too:
//   targets        RMSE levels of the suite, falling; spec {rmse, mtf} of the suite, and spec_text, a sentence, where
//   all
//                  groups have the same
//   group.spec_rmse, group.spec_mtf {lp_per_mm, centre, corner, diffraction}: what counts as good enough there
//   gates          [{name, ok, text}]: whether the numbers may be believed
//   group.floor    {own_optimum, next_image}: median RMSE of the lenses' own best poses; the Cramer-Rao bound of one
//                  more image
//   group.rows[i]  recommended, commanded {n, median, q25, q75, lo95, hi95, iqm, iqm_lo95, iqm_hi95}; yield {in, n,
//                  share, lo95, hi95, uncured {the same, before the glue cures}}; mtf {centre, corner {n, median, q25,
//                  q75}}; to_spec {successes, n, steps, lo95, hi95, expected, seconds}; residual {axes
//                  [{name, unit, median, q75}]} of the recommended pose against the lens's own best one, without sign
//   group.curves[i].tracks[t]  also lo95, hi95, null where no band was computed; curves[i].machine_seconds and
//                  .algorithm_seconds: medians by which each step was done
//   group.ecdf     [{method, steps [], share []}]: how many of all targets of all lenses are reached by which step
//   group.pairs    [{a, b, n, ratio, lo95, hi95, improvement, p, p_holm, verdict, reason}]: a against b, on the same
//                  lenses; why it is undecided; of those that the analysis plan names also planned, p_planned, and
//                  where there is a specification yields {n, a, b, a_alone, b_alone, p, p_planned}
//   rule           "own", "best" or "current": what everything named recommended, yield, to_spec, ecdf, pairs is by
//   group.rows[i].rules, group.rules: the same by each rule, rules_data.h; rules_note, a sentence
//   analysis       what was planned before the run, analysis_notes: sentences about it (rules_data.h)
//   training       [{method, hours, steps, machine, pays_after [{group, label, lenses, against, saves}]}]: group is a
//                  place in groups; lenses a number, "never" or null; saves seconds a lens, against the fastest method
//                  that learnt nothing
//   aggregate      one number a method over all scenes and noise levels: aggregate_data.h
//   scene_facts    what scene_data.h says of each scene
// Of folders merged for the page alone: merged_for_this_page, and merge_notes, sentences.
// Of several folders with different instance sets: parts (several_folders.h), and scenes and labels name their folder.
#pragma once

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

Json page_data(const LoadedResults& results, const statistics::Study& study);
Json page_data(const LoadedResults& results);  // makes the study

// Of data's "methods": the label of the one that a row of a group under this protocol is of; the name without one.
std::string label_of(const Json& methods, const std::string& name, const std::string& protocol);

// What ranks a row: the error at the recommended pose, or, where no truth is known ("measured_only" of its
// group), the lowest measured one. {n, median, q25, q75}.
const Json& score_of(const Json& row);

// Numbers on the page and in its data agree with the tables to 1e-9.
inline constexpr int kDataDigits = 10;

// `value` with that many significant digits: pages need no more, and shorter numbers keep them small.
double rounded(double value, int digits);

// Rounded to kDataDigits; null where there is no finite number.
Json shown_number(double value);

}  // namespace relign::report
