// Assembles the page from its template, sections, scripts and data.
#pragma once

#include <map>
#include <string>

#include "report/page_model.h"
#include "report/pictures.h"

namespace relign::report {

// `rmse`: final error by trial id, for the captions of the pictures.
std::string page_html(const PageModel& page, const Gallery& gallery, const std::map<std::string, double>& rmse);

// A source of the content security policy that allows exactly this script, so that injected markup cannot run.
std::string script_source(const std::string& script);

// Replaces each {{name}} of the template; inserted text is not searched again. Throws Error (internal) for unknown
// names.
std::string filled(std::string_view page_template, const std::map<std::string, std::string>& parts);

}  // namespace relign::report
