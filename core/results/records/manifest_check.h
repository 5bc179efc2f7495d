// Compares the parts of a results folder's manifest with each other and with the suite text that it holds.
#pragma once

#include <filesystem>

#include "base/json_source.h"

namespace relign::records {

// Throws Error(bad_input) with every contradiction: a commitment that the suite does not have, or that is to another
// secret; other seeds or numbers of instances, scenes or noise levels than the suite states; a number of trials that is
// not that of the list. Only members that both have are compared, apart from
// commitment and secret. `folder` is for the message.
void require_consistent(const Json& manifest, const std::filesystem::path& folder);

}  // namespace relign::records
