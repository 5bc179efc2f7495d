// The ranking as text, from the page's data.
#pragma once

#include <string>

#include "base/json_source.h"

namespace relign::report {

// For the terminal: at most 90 columns, a block per scene, noise level and protocol.
std::string ranking_table(const Json& data);

// A table per scene and protocol.
std::string markdown_tables(const Json& data);

// CSV: a header, and a row per method, scene, noise level and protocol with the numbers of page_data
// (results/README.md, "Ranking as CSV"). `folder` is the value of the first column, so that tables of several folders
// can be concatenated.
std::string ranking_csv_head();
std::string ranking_csv_rows(const Json& data, const std::string& folder);

}  // namespace relign::report
