// The ranking as one tidy table, for pandas, R and spreadsheets: one row per method and group.
#include <array>
#include <string>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/escape.h"
#include "report/page_data.h"
#include "report/text_tables.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

struct CsvColumn {
  const char* name;
  const char* member;  // of the row, or of one of its objects: "yield/share"
};
// After the columns that identify the row. results/README.md describes them.
constexpr std::array kNumbers = {CsvColumn{"recommended_median", "/recommended/median"},
                                 CsvColumn{"recommended_q25", "/recommended/q25"},
                                 CsvColumn{"recommended_q75", "/recommended/q75"},
                                 CsvColumn{"recommended_lo95", "/recommended/lo95"},
                                 CsvColumn{"recommended_hi95", "/recommended/hi95"},
                                 CsvColumn{"recommended_iqm", "/recommended/iqm"},
                                 CsvColumn{"recommended_iqm_lo95", "/recommended/iqm_lo95"},
                                 CsvColumn{"recommended_iqm_hi95", "/recommended/iqm_hi95"},
                                 CsvColumn{"commanded_median", "/commanded/median"},
                                 CsvColumn{"commanded_q25", "/commanded/q25"},
                                 CsvColumn{"commanded_q75", "/commanded/q75"},
                                 CsvColumn{"commanded_lo95", "/commanded/lo95"},
                                 CsvColumn{"commanded_hi95", "/commanded/hi95"},
                                 CsvColumn{"measured_median", "/measured/median"},
                                 CsvColumn{"measured_q25", "/measured/q25"},
                                 CsvColumn{"measured_q75", "/measured/q75"},
                                 CsvColumn{"in_spec", "/yield/in"},
                                 CsvColumn{"in_spec_of", "/yield/n"},
                                 CsvColumn{"yield", "/yield/share"},
                                 CsvColumn{"yield_lo95", "/yield/lo95"},
                                 CsvColumn{"yield_hi95", "/yield/hi95"},
                                 CsvColumn{"yield_uncured", "/yield/uncured/share"},
                                 CsvColumn{"yield_uncured_lo95", "/yield/uncured/lo95"},
                                 CsvColumn{"yield_uncured_hi95", "/yield/uncured/hi95"},
                                 CsvColumn{"steps_to_spec", "/to_spec/steps"},
                                 CsvColumn{"steps_to_spec_lo95", "/to_spec/lo95"},
                                 CsvColumn{"steps_to_spec_hi95", "/to_spec/hi95"},
                                 CsvColumn{"expected_steps_to_spec", "/to_spec/expected"},
                                 CsvColumn{"seconds_to_spec", "/to_spec/seconds"},
                                 CsvColumn{"machine_seconds_median", "/machine_seconds"},
                                 CsvColumn{"algorithm_ms_per_step_median", "/algorithm_ms_per_step"},
                                 CsvColumn{"mtf_centre_median", "/mtf/centre/median"},
                                 CsvColumn{"mtf_corner_median", "/mtf/corner/median"}};
// Members of the group, after those of the row.
constexpr std::array kSpecMtf = {CsvColumn{"spec_mtf_lp_per_mm", "/spec_mtf/lp_per_mm"},
                                 CsvColumn{"spec_mtf_centre", "/spec_mtf/centre"},
                                 CsvColumn{"spec_mtf_corner", "/spec_mtf/corner"}};

// Per recommendation rule, prefixed with its name: own_median, best_yield.
constexpr std::array kOfRule = {CsvColumn{"median", "/median"},
                                CsvColumn{"lo95", "/lo95"},
                                CsvColumn{"hi95", "/hi95"},
                                CsvColumn{"yield", "/yield/share"},
                                CsvColumn{"yield_lo95", "/yield/lo95"},
                                CsvColumn{"yield_hi95", "/yield/hi95"},
                                CsvColumn{"steps_to_spec", "/steps"}};

// "never" becomes inf, which pandas and R read as a number.
std::string number_text(const Json& object, const char* member) {
  const Json::json_pointer place(member);
  if (!object.contains(place)) return "";
  const Json& value = object[place];
  if (value.is_string() && value == "never") return "inf";
  if (value.is_number_float()) return shortest(value.get<double>());
  return value.is_number() ? value.dump() : "";
}

}  // namespace

std::string ranking_csv_head() {
  std::string csv =
      "results,scene,noise_level,protocol,algorithm,rank,ranked_by,oracle,trials,failed,step,"
      "start_median,own_optimum_median,spec_rmse";
  for (const CsvColumn& column : kNumbers) csv += std::string(",") + column.name;
  for (const CsvColumn& column : kSpecMtf) csv += std::string(",") + column.name;
  csv += ",rule,class,merit,method_key";
  for (const statistics::Rule rule : statistics::kRules)
    for (const CsvColumn& column : kOfRule) csv += std::string(",") + statistics::rule_name(rule) + "_" + column.name;
  return csv + ",trainings\n";
}

std::string ranking_csv_rows(const Json& data, const std::string& folder) {
  std::string csv;
  for (const Json& group : data["groups"]) {
    std::size_t rank = 0;
    const std::string place = csv_field(folder) + ',' + csv_field(text_of(group, "scene")) + ',' +
                              csv_field(text_of(group, "noise_level")) + ',' + csv_field(text_of(group, "protocol")) +
                              ',';
    for (const Json& row : group["rows"]) {
      ++rank;
      const bool has_result = count_of(score_of(row), "n") > 0;
      csv += place + csv_field(text_of(row, "method")) + ',' + (has_result ? std::to_string(rank) : "") + ',' +
             (row.contains("measured") ? "measured" : "recommended") + ',' +
             (flag_of(row, "oracle") ? "true" : "false") + ',' + number_text(row, "/trials") + ',' +
             number_text(row, "/failed") + ',' + number_text(row, "/step") + ',' + number_text(group, "/start") + ',' +
             number_text(group, "/floor/own_optimum") + ',' + number_text(group, "/spec_rmse");
      for (const CsvColumn& column : kNumbers) csv += ',' + number_text(row, column.member);
      for (const CsvColumn& column : kSpecMtf) csv += ',' + number_text(group, column.member);
      csv += ',' + text_of(data, "rule") + ',' + csv_field(text_of(row, "class")) + ',' +
             csv_field(text_of(row, "merit")) + ',' + text_of(row, "key");
      for (const statistics::Rule rule : statistics::kRules) {
        const Json& score = object_of(object_of(row, "rules"), statistics::rule_name(rule));
        for (const CsvColumn& column : kOfRule) csv += ',' + number_text(score, column.member);
      }
      csv += ',' + csv_field(text_of(row, "training_tag")) + '\n';
    }
  }
  return csv;
}

}  // namespace relign::report
