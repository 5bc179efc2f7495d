// The model as the JSON document of `report --format json` (docs/schemas/report.schema.json).
#pragma once

#include "report/page_model.h"

namespace relign::report {

// Of one folder, or of several with the same instance set. Unknown numbers are null, infinite steps "never".
Json to_json(const PageModel& page);

}  // namespace relign::report
