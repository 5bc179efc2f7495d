// The ranking as text, from the page's data.
#pragma once

#include <string>

#include "base/json_source.h"

namespace relign::report {

// For the terminal: at most 90 columns, a block per scene, noise level and protocol.
std::string ranking_table(const Json& data);

// A table per scene and protocol.
std::string markdown_tables(const Json& data);

}  // namespace relign::report
