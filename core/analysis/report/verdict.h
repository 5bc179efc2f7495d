// The verdict in words. It says what the medians say and what they do not: no significance is
// claimed, quartiles are named as such, methods that know more than the others are named too.
#pragma once

#include "base/json_source.h"

namespace relign::report {

// From page_data's "groups": [{label, best, text}], one entry a group; `best` is "" where nothing can be ranked.
Json verdict(const Json& data);

// Sentences a reader must see before trusting the ranking: list of texts.
Json beware(const Json& data);

// Where computing times of this folder say little, a sentence; else empty. Errors and images are not concerned.
std::string computing_time_note(const Json& data);

}  // namespace relign::report
