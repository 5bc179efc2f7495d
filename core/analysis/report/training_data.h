// What learning beforehand has cost, and after how many lenses it is repaid (docs/statistics.md).
#pragma once

#include "base/json_source.h"

namespace relign::report {

// Lenses after which `hours` of learning are repaid by what each lens then saves, rounded up. Seconds are those of one
// lens until it is in specification; infinite where most lenses never get there. Infinite where nothing is saved; NaN
// where one of the three is not known, or nobody else gets there.
double pays_after(double hours, double seconds_trained, double seconds_untrained);

// page_data's "training": from the manifest's algorithms and what was prepared, and the rows of data's groups. Empty
// where nobody learnt.
Json training_data(const Json& data, const Json& manifest);

}  // namespace relign::report
