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

struct Column {
  const char* name;
  const char* member;  // of the row, or of one of its objects: "yield/share"
};
// After the columns that identify the row. results/README.md describes them.
constexpr std::array kNumbers = {Column{"recommended_median", "/recommended/median"},
                                 Column{"recommended_q25", "/recommended/q25"},
                                 Column{"recommended_q75", "/recommended/q75"},
                                 Column{"recommended_lo95", "/recommended/lo95"},
                                 Column{"recommended_hi95", "/recommended/hi95"},
                                 Column{"recommended_iqm", "/recommended/iqm"},
                                 Column{"recommended_iqm_lo95", "/recommended/iqm_lo95"},
                                 Column{"recommended_iqm_hi95", "/recommended/iqm_hi95"},
                                 Column{"commanded_median", "/commanded/median"},
                                 Column{"commanded_q25", "/commanded/q25"},
                                 Column{"commanded_q75", "/commanded/q75"},
                                 Column{"commanded_lo95", "/commanded/lo95"},
                                 Column{"commanded_hi95", "/commanded/hi95"},
                                 Column{"measured_median", "/measured/median"},
                                 Column{"measured_q25", "/measured/q25"},
                                 Column{"measured_q75", "/measured/q75"},
                                 Column{"in_spec", "/yield/in"},
                                 Column{"in_spec_of", "/yield/n"},
                                 Column{"yield", "/yield/share"},
                                 Column{"yield_lo95", "/yield/lo95"},
                                 Column{"yield_hi95", "/yield/hi95"},
                                 Column{"yield_uncured", "/yield/uncured/share"},
                                 Column{"yield_uncured_lo95", "/yield/uncured/lo95"},
                                 Column{"yield_uncured_hi95", "/yield/uncured/hi95"},
                                 Column{"steps_to_spec", "/to_spec/steps"},
                                 Column{"steps_to_spec_lo95", "/to_spec/lo95"},
                                 Column{"steps_to_spec_hi95", "/to_spec/hi95"},
                                 Column{"expected_steps_to_spec", "/to_spec/expected"},
                                 Column{"seconds_to_spec", "/to_spec/seconds"},
                                 Column{"machine_seconds_median", "/machine_seconds"},
                                 Column{"algorithm_ms_per_step_median", "/algorithm_ms_per_step"},
                                 Column{"mtf_centre_median", "/mtf/centre/median"},
                                 Column{"mtf_corner_median", "/mtf/corner/median"}};
// Members of the group, after those of the row.
constexpr std::array kSpecMtf = {Column{"spec_mtf_lp_per_mm", "/spec_mtf/lp_per_mm"},
                                 Column{"spec_mtf_centre", "/spec_mtf/centre"},
                                 Column{"spec_mtf_corner", "/spec_mtf/corner"}};

// Per recommendation rule, prefixed with its name: own_median, best_yield.
constexpr std::array kOfRule = {Column{"median", "/median"},
                                Column{"lo95", "/lo95"},
                                Column{"hi95", "/hi95"},
                                Column{"yield", "/yield/share"},
                                Column{"yield_lo95", "/yield/lo95"},
                                Column{"yield_hi95", "/yield/hi95"},
                                Column{"steps_to_spec", "/steps"}};

// "never" becomes inf, which pandas and R read as a number.
std::string number(const Json& object, const char* member) {
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
  for (const Column& column : kNumbers) csv += std::string(",") + column.name;
  for (const Column& column : kSpecMtf) csv += std::string(",") + column.name;
  csv += ",rule,class,merit,method_key";
  for (const statistics::Rule rule : statistics::kRules)
    for (const Column& column : kOfRule) csv += std::string(",") + statistics::rule_name(rule) + "_" + column.name;
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
             (flag_of(row, "oracle") ? "true" : "false") + ',' + number(row, "/trials") + ',' + number(row, "/failed") +
             ',' + number(row, "/step") + ',' + number(group, "/start") + ',' + number(group, "/floor/own_optimum") +
             ',' + number(group, "/spec_rmse");
      for (const Column& column : kNumbers) csv += ',' + number(row, column.member);
      for (const Column& column : kSpecMtf) csv += ',' + number(group, column.member);
      csv += ',' + text_of(data, "rule") + ',' + csv_field(text_of(row, "class")) + ',' +
             csv_field(text_of(row, "merit")) + ',' + text_of(row, "key");
      for (const statistics::Rule rule : statistics::kRules) {
        const Json& score = object_of(object_of(row, "rules"), statistics::rule_name(rule));
        for (const Column& column : kOfRule) csv += ',' + number(score, column.member);
      }
      csv += ',' + csv_field(text_of(row, "training_tag")) + '\n';
    }
  }
  return csv;
}

}  // namespace relign::report
