// One section of the page, as HTML.
#pragma once

#include <string>

#include "report/sections.h"

namespace relign::report {

inline std::string written(void (*section)(PageWriter&, const PageParts&), const PageModel& page) {
  Json charts = Json::array();
  const Gallery gallery;
  const FinalErrors rmse;
  PageWriter out(charts);
  section(out, {page, gallery, rmse});
  return out.take();
}

}  // namespace relign::report
