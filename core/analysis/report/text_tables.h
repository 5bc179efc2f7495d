// The ranking as text, from the page's data.
#pragma once

#include <string>

#include "base/json_source.h"

namespace relign::report {

// For the terminal: at most 90 columns, a block per scene, noise level and protocol.
std::string ranking_table(const Json& data);

// A table per scene and protocol.
std::string markdown_tables(const Json& data);

// For programs: a line of names, and a line for each method of each scene, noise level and protocol, with the numbers
// of the page's data as they stand (results/README.md, "Ranking as CSV"). `folder` fills the first column, so that
// tables of several folders can be put one below the other.
std::string ranking_csv_head();
std::string ranking_csv_rows(const Json& data, const std::string& folder);

}  // namespace relign::report
