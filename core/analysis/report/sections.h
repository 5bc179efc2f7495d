// The sections of the page, from the model and pictures; a section without data writes nothing. Each is listed once, in
// page.cpp.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/page_model.h"
#include "report/page_writer.h"
#include "report/pictures.h"

namespace relign::report {

// Final error by trial id, for the captions of the pictures.
using FinalErrors = std::map<std::string, double>;

// What a section may use.
struct PageParts {
  const PageModel& page;
  const Gallery& gallery;
  const FinalErrors& rmse;
};

// section_first.cpp: the first screen, then what unfolds from it
void title_section(PageWriter& out, const PageParts& parts);
void verdict_section(PageWriter& out, const PageParts& parts);

void aggregate_section(PageWriter& out, const PageParts& parts);
void ranking_section(PageWriter& out, const PageParts& parts);
void further_scores_section(PageWriter& out, const PageParts& parts);
void specification_section(PageWriter& out, const PageParts& parts);  // each criterion of the specification
void cost_section(PageWriter& out, const PageParts& parts);           // by the prices of the suite
void rules_section(PageWriter& out, const PageParts& parts);          // results by each rule
void analysis_section(PageWriter& out, const PageParts& parts);       // section_rules.cpp: the analysis plan
void levels_section(PageWriter& out, const PageParts& parts);         // section_matrix.cpp: over the noise levels
void matrix_section(PageWriter& out, const PageParts& parts);         // excess errors, methods x groups
void heat_section(PageWriter& out, const PageParts& parts);  // section_matrix.cpp: yields or errors, methods x groups
void pairs_section(PageWriter& out, const PageParts& parts);
void training_section(PageWriter& out, const PageParts& parts);

// section_pictures.cpp
void curve_cards(PageWriter& out, const PageParts& parts);        // a card per group, within the template's section
void film_strips(PageWriter& out, const PageParts& parts);        // within the viewer
Json replay_data(const PageModel& page, const Gallery& gallery);  // data of replay.js
void scene_section(PageWriter& out, const PageParts& parts);
void gallery_section(PageWriter& out, const PageParts& parts);

// section_record.cpp
void ran_section(PageWriter& out, const PageParts& parts);
void methods_section(PageWriter& out, const PageParts& parts);
void provenance_section(PageWriter& out, const PageParts& parts);

// The median error of a method with its interval, else its quartiles (section_ranking.cpp).
Cell error_cell(const Row& row);
Cell moves_cell(const Row& row);  // to specification, with their interval

// Columns of the ranking for the statistics with in_ranking; none without ground truth (section_ranking.cpp).
std::vector<ColumnOf<Row>> final_columns(const PageModel& page,
                                         const statistics::FinalStatistics& statistics = statistics::kFinalStatistics);

// Data of curves.js (curve_data.cpp), thinned to limit the size of the page.
Json curve_data(const PageModel& page);

}  // namespace relign::report
