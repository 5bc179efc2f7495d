// The ranking as text.
#pragma once

#include <string>

#include "report/page_model.h"

namespace relign::report {

// For the terminal: at most 90 columns, a block per scene, noise level and protocol.
std::string ranking_table(const PageModel& page);

// A table per scene and protocol, after the failed checks and before the caveats of the page.
std::string markdown_tables(const PageModel& page);

// CSV: a header, and a row per method, scene, noise level and protocol with the numbers of the page
// (results/README.md, "Ranking as CSV"). `folder` is the value of the first column, so that tables of several folders
// can be concatenated; all have the columns that one of them needs.
struct MoreColumns {
  bool cycle = false;       // seconds, for suites with a cycle
  bool score = false;       // name and unit, for scenes that declare their score
  std::size_t further = 0;  // the most further scores of a scene
};
std::string ranking_csv_head(const MoreColumns& more = {});
std::string ranking_csv_rows(const PageModel& page, const std::string& folder, const MoreColumns& more = {});

}  // namespace relign::report
