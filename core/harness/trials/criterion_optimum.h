// The own optimum of a lens under limits of MTF by field.
#pragma once

#include <functional>
#include <vector>

#include "trials/judge.h"

namespace relign::trials {

// The pose where the largest deficit (limit - MTF), plus 1e-4 per squared pixel of the image's shift, is lowest. The
// second term decides between poses of equal MTF, since a shift alone hardly changes it. Over the observable axes;
// others stay at `start`. Rounded to 1e-5 of the travel.
//
// A lens as built can have several local optima, tens of arc minutes apart. So a model comes first: every field keeps
// its through-focus curve, and other axes only move its focus, by a linear function of the field's place in the image.
// Its curves and slopes are measured around `start` (0.15 of the travel of "z", and small steps of the other axes), its
// local optima over z and the two axes that move focus most are found on a grid, and from the best of them quadratic
// models of the logarithms of the MTFs lead to the optimum in ever smaller neighbourhoods. Without an axis "z" that
// search starts at `start`.
//
// measure: all fields at a true pose, at the criteria's frequency. design: of the perfect lens at the nominal pose.
Judge::Optimum criterion_optimum(const std::function<FieldValues(const std::vector<double>&)>& measure,
                                 const SceneFacts& scene, const Criteria& criteria, const FieldValues& design,
                                 const std::vector<double>& start);

// Measurements of all fields that it makes, for five axes and one local optimum. For estimates of run time.
inline constexpr int kTypicalMeasurements = 170;

}  // namespace relign::trials
