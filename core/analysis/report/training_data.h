// Training cost and its break-even point (docs/statistics.md).
#pragma once

#include "base/json_source.h"

namespace relign::report {

// Break-even point: the number of lenses, rounded up, after which `hours` of training are offset by the time that each
// lens saves. Seconds are until one lens is in specification, infinite if fewer than half of the instances reach it.
// The result is infinite if nothing is saved, NaN if an argument is NaN or no untrained method reaches the
// specification.
double pays_after(double hours, double seconds_trained, double seconds_untrained);

// page_data's "training": from the manifest's algorithms and pretraining, and the rows of data's groups. Empty without
// trained methods.
Json training_data(const Json& data, const Json& manifest);

}  // namespace relign::report
