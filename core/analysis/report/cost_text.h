// Costs of a good module (statistics/costs.h) as text: section_cost.cpp.
#pragma once

#include <string>

#include "report/page_model.h"

namespace relign::report {

// Images of a module, the one at the start included: "9", or "7 / 9" for the two halves of the instances.
std::string images_of(const statistics::CostStudy& cost);

// The prices as a sentence.
std::string prices_sentence(const Prices& prices);

// costs.csv: two rows per method and group at most, "budget" and "least_cost". Only its head without prices.
std::string costs_csv(const PageModel& page);

}  // namespace relign::report
