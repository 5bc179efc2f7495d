// Puts the page together from its template, the sections, the script and the data.
#pragma once

#include <map>
#include <string>

#include "base/json_source.h"
#include "report/pictures.h"

namespace relign::report {

// `rmse`: by trial id, for the captions of the pictures.
std::string page(const Json& data, const Gallery& gallery, const std::map<std::string, double>& rmse);

// Replaces every {{name}} of the template; what is put in is not looked at again.
std::string filled(std::string_view page_template, const std::map<std::string, std::string>& parts);

}  // namespace relign::report
