// Training cost and its break-even point (docs/statistics.md).
#pragma once

#include "records/manifest.h"
#include "report/page_model.h"

namespace relign::report {

// Break-even point: the number of lenses, rounded up, after which `hours` of training are offset by the time that each
// lens saves. Seconds are until one lens is in specification, infinite if fewer than half of the instances reach it.
// The result is infinite if nothing is saved, NaN if an argument is NaN or no untrained method reaches the
// specification.
double pays_after(double hours, double seconds_trained, double seconds_untrained);

// From the manifest's algorithms and pretraining, and the rows of the groups. Empty without trained methods.
std::vector<TrainingCost> training_costs(const records::Manifest& manifest, const std::vector<Method>& methods,
                                         const std::vector<Group>& groups);

}  // namespace relign::report
