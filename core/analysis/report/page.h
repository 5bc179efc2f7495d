// Assembles the page from its template, sections, scripts and data.
#pragma once

#include <map>
#include <string>

#include "report/sections.h"

namespace relign::report {

std::string page_html(const PageModel& page, const Gallery& gallery, const FinalErrors& rmse);

// The viewer of films with its strips, whose data is replay_data(); "" without films.
std::string replay_html(const PageParts& parts);

// A template (assets/) with its parts, besides style and scripts, which are the same on every page. `style`: more
// rules; `data`: of the scripts. The content security policy allows exactly these scripts, so that injected markup
// cannot run.
std::string document(std::string_view page_template, std::map<std::string, std::string> parts, const Json& data,
                     std::string_view style = "");

// Replaces each {{name}} of the template; inserted text is not searched again. Throws Error (internal) for unknown
// names.
std::string filled(std::string_view page_template, const std::map<std::string, std::string>& parts);

}  // namespace relign::report
