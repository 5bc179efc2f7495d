// The sections of the page as HTML, from page_data and pictures, one file each: section_<name>.cpp. They are complete
// without scripts, which add sorting, zoomable curves and the replay. A section without data is empty.
#pragma once

#include <map>
#include <string>

#include "base/json_source.h"
#include "report/pictures.h"

namespace relign::report {

// section_title.cpp
std::string title_section(const Json& data);    // heading, badges, introduction
std::string verdict_section(const Json& data);  // preceded by failed gates

std::string aggregate_section(const Json& data);
std::string ranking_section(const Json& data);
std::string rules_section(const Json& data);     // section_rules.cpp: results by each rule
std::string analysis_section(const Json& data);  // section_rules.cpp: the analysis plan
std::string heat_section(const Json& data);      // section_heat.cpp: methods x groups
std::string levels_section(const Json& data);    // section_levels.cpp: over the noise levels
std::string pairs_section(const Json& data);
std::string training_section(const Json& data);
std::string curve_cards(const Json& data, const Gallery& gallery);  // section_curves.cpp
std::string replay_section(const Json& data, const Gallery& gallery);
Json replay_data(const Json& data, const Gallery& gallery);  // data of replay.js
std::string scene_section(const Json& data, const Gallery& gallery);
std::string gallery_section(const Json& data, const Gallery& gallery, const std::map<std::string, double>& rmse);

// section_record.cpp
std::string ran_section(const Json& data, const Gallery& gallery);
std::string methods_section(const Json& data);
std::string provenance_section(const Json& data);

// Data of curves.js (curve_data.cpp), thinned to limit the size of the page.
Json curve_data(const Json& data);

// Helpers shared by the sections.
std::string number_text(const Json& number, int digits);  // "-" for null
std::string joined(const Json& list, const std::string& separator);
std::string sort_value(const Json& number);  // for data-sort; "" for null
bool any_group(const Json& data, const char* flag);
bool every_group(const Json& data, const char* flag);
bool any_row(const Json& data, const char* member);  // some row has this member

}  // namespace relign::report
