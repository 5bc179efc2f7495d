// The parts of the page as HTML, each made from page_data (and pictures) alone. They need no
// script: sorting and curves come on top.
#pragma once

#include <map>
#include <string>

#include "base/json_source.h"
#include "report/pictures.h"

namespace relign::report {

std::string title_section(const Json& data);  // heading, badges, what this is
std::string verdict_section(const Json& data);
std::string ranking_section(const Json& data);
std::string curve_cards(const Json& data, const Gallery& gallery);
std::string gallery_section(const Json& data, const Gallery& gallery, const std::map<std::string, double>& rmse);
std::string picture_definitions(const Gallery& gallery);  // each picture once, for the <use> elements
std::string ran_section(const Json& data, const Gallery& gallery);
std::string methods_section(const Json& data);
std::string provenance_section(const Json& data);

// Helpers shared by the sections.
std::string number_text(const Json& number, int digits);            // "-" for null
std::string counted(std::uint64_t count, const std::string& noun);  // "1 trial", "2 trials"
std::string joined(const Json& list, const std::string& separator);
bool any_group(const Json& data, const char* flag);
bool every_group(const Json& data, const char* flag);

}  // namespace relign::report
