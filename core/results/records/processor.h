// Which processors may give other numbers.
#pragma once

#include "base/json_source.h"

namespace relign::records {

// Of two objects "machine" of manifests: whether plugins that are reproducible on one kind of processor give the same
// numbers on both. By instruction sets; by the processors' names where a manifest was written before it had those.
bool same_processor(const Json& one, const Json& other);

}  // namespace relign::records
