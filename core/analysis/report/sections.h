// The parts of the page as HTML, each made from page_data (and pictures) alone, one file each: section_<name>.cpp. They
// need no script: sorting, zoomable curves and the replay come on top. A part whose data are absent is empty.
#pragma once

#include <map>
#include <string>

#include "base/json_source.h"
#include "report/pictures.h"

namespace relign::report {

// section_title.cpp
std::string title_section(const Json& data);    // heading, badges, what this is
std::string verdict_section(const Json& data);  // broken gates before it

std::string aggregate_section(const Json& data);
std::string ranking_section(const Json& data);
std::string rules_section(const Json& data);     // section_rules.cpp: every rule beside each other
std::string analysis_section(const Json& data);  // section_rules.cpp: what was planned before the run
std::string heat_section(const Json& data);      // section_heat.cpp: methods x groups
std::string levels_section(const Json& data);    // section_levels.cpp: over the noise levels
std::string pairs_section(const Json& data);
std::string training_section(const Json& data);
std::string curve_cards(const Json& data, const Gallery& gallery);  // section_curves.cpp
std::string replay_section(const Json& data, const Gallery& gallery);
Json replay_data(const Json& data, const Gallery& gallery);  // what replay.js needs
std::string scene_section(const Json& data, const Gallery& gallery);
std::string gallery_section(const Json& data, const Gallery& gallery, const std::map<std::string, double>& rmse);

// section_record.cpp
std::string ran_section(const Json& data, const Gallery& gallery);
std::string methods_section(const Json& data);
std::string provenance_section(const Json& data);

// What the curves' script needs (curve_data.cpp), thinned where there are so many that the page would become large.
Json curve_data(const Json& data);

// Helpers shared by the sections.
std::string number_text(const Json& number, int digits);            // "-" for null
std::string counted(std::uint64_t count, const std::string& noun);  // "1 trial", "2 trials"
std::string joined(const Json& list, const std::string& separator);
std::string sort_value(const Json& number);  // for data-sort; "" for null
bool any_group(const Json& data, const char* flag);
bool every_group(const Json& data, const char* flag);
bool any_row(const Json& data, const char* member);  // some row has this object

}  // namespace relign::report
