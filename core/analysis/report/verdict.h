// The verdict as text, and the caveats that belong to it. Intervals and quartiles are named as such, oracles are not
// ranked, and methods are ranked within their observation class.
#pragma once

#include "base/json_source.h"

namespace relign::report {

// One entry per group of page_data: [{label, best, text}], with several observation classes also classes [{class,
// title, best, text}] and rest. `best` is "" if nothing can be ranked.
Json verdict(const Json& data);

// Caveats that a reader needs before relying on the ranking: a list of sentences ("caveats" in page_data).
Json caveats(const Json& data);

// A sentence if compute times of this folder are unreliable, else empty.
std::string computing_time_note(const Json& data);

}  // namespace relign::report
