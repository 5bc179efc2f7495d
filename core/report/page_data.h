// Everything the page says in words and numbers, as one JSON value: the HTML sections, the script
// that draws the curves and the golden test all read this and nothing else. Pictures stand apart.
//
// Shape: {suite_name, suite_file, suite_text, seed, command, scenes, noise_levels, protocols, steps [least, most],
// instances, ran {planned, finished, failed, missing, incomplete, from_other_plans}, methods [...], groups [{scene,
// noise_level, protocol, label, instances, same_instances, start, rows, curves, measured_only and station (when
// true)}], verdict, beware, failures, warnings,
// program, machine, of a merged folder sources [{folder, trials, cpu, program}] and merge}. A group is what can be
// compared: one scene, noise level and protocol.
#pragma once

#include "report/loaded_results.h"
#include "stats/curves.h"

namespace relign::report {

Json page_data(const LoadedResults& results, const std::vector<stats::Curve>& curves);
Json page_data(const LoadedResults& results);  // makes the curves

// What ranks a row: the error at the recommended pose, or, where no truth is known ("measured_only" of its
// group), the lowest measured one. {n, median, q25, q75}.
const Json& score_of(const Json& row);

// `value` with that many significant digits: pages need no more, and shorter numbers keep them small.
double rounded(double value, int digits);

}  // namespace relign::report
