// Compares processors for reproducibility.
#pragma once

#include "base/json_source.h"

namespace relign::records {

// For the "machine" objects of two manifests: whether plugins that are reproducible only on one processor give the same
// numbers on both. Compares instruction sets, or the processors' names where an older manifest lacks them.
bool same_processor(const Json& one, const Json& other);

}  // namespace relign::records
