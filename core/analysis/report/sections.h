// The sections of the page as HTML, from the model and pictures, one file each: section_<name>.cpp. They are complete
// without scripts, which add sorting, zoomable curves and the replay. A section without data is empty.
#pragma once

#include <initializer_list>
#include <map>
#include <string>

#include "markup/html_writer.h"
#include "report/page_model.h"
#include "report/pictures.h"

namespace relign::report {

// section_title.cpp
std::string title_section(const PageModel& page);    // heading, badges, introduction
std::string verdict_section(const PageModel& page);  // preceded by failed gates

std::string aggregate_section(const PageModel& page);
std::string ranking_section(const PageModel& page);
std::string specification_section(const PageModel& page);  // section_specification.cpp: each criterion of the spec
std::string cost_section(const PageModel& page);           // section_cost.cpp: by the prices of the suite
std::string rules_section(const PageModel& page);          // section_rules.cpp: results by each rule
std::string analysis_section(const PageModel& page);       // section_rules.cpp: the analysis plan
std::string matrix_section(const PageModel& page);         // section_matrix.cpp: excess errors, methods x groups
std::string heat_section(const PageModel& page);           // section_heat.cpp: methods x groups
std::string levels_section(const PageModel& page);         // section_levels.cpp: over the noise levels
std::string pairs_section(const PageModel& page);
std::string training_section(const PageModel& page);
std::string curve_cards(const PageModel& page, const Gallery& gallery);  // section_curves.cpp
std::string replay_section(const PageModel& page, const Gallery& gallery);
Json replay_data(const PageModel& page, const Gallery& gallery);  // data of replay.js
std::string scene_section(const PageModel& page, const Gallery& gallery);
std::string gallery_section(const PageModel& page, const Gallery& gallery, const std::map<std::string, double>& rmse);

// section_record.cpp
std::string ran_section(const PageModel& page, const Gallery& gallery);
std::string methods_section(const PageModel& page);
std::string provenance_section(const PageModel& page);

// Data of curves.js (curve_data.cpp), thinned to limit the size of the page.
Json curve_data(const PageModel& page);

// A name's tag: "oracle", "one training"; nothing if empty.
void tag(HtmlWriter& html, const std::string& text);

// The head of a table's column: `kind` is its class, `hint` its tooltip.
void column_head(HtmlWriter& html, const char* kind, const std::string& title, const std::string& unit,
                 const std::string& hint);

// The whole head of a plain table.
void table_head(HtmlWriter& html, std::initializer_list<const char*> titles);

// The first cell of a row: a method with its tags.
void method_cell(HtmlWriter& html, const std::string& method, bool oracle, const std::string& training_tag);

// A table cell with the estimate in bold and its interval, both perhaps absent.
void interval_cell(HtmlWriter& html, const std::string& kind, const std::string& sort, const std::string& value,
                   const std::string& interval, const std::string& title = "");

// A table cell with a dot at the estimate and a bar over the interval, on a scale from 0 to 1.
void range_cell(HtmlWriter& html, const statistics::Band& band);

}  // namespace relign::report
