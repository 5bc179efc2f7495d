// The ranking as one tidy table, for pandas, R and spreadsheets: one row per method and group.
#include <array>
#include <string>

#include "base/text.h"
#include "markup/escape.h"
#include "report/text_tables.h"

namespace relign::report {
namespace {

// Infinity, which pandas and R read as a number, if fewer than half of the instances arrive; "" if unknown.
std::string field(double value) { return std::isinf(value) ? "inf" : sort_value(value); }

template <class Source>
struct CsvColumn {
  const char* name;
  std::string (*text)(const Source&);
};

// Columns of optional parts, which are NaN or absent without the part.
Score measured(const Row& row) { return row.measured.value_or(Score()); }
Yield yield(const Row& row) { return row.yield.value_or(Yield()); }
Share uncured(const Row& row) { return yield(row).uncured.value_or(Share()); }
TimeToSpec to_spec(const Row& row) { return row.to_spec.value_or(TimeToSpec()); }
MtfScores mtf(const Row& row) { return row.mtf.value_or(MtfScores()); }
Share yield(const RuleScore& score) { return score.yield.value_or(Share()); }

// After the columns that identify the row. results/README.md describes them.
constexpr std::array kRecommended = {
    CsvColumn<Row>{"recommended_median", [](const Row& row) { return field(row.recommended.median); }},
    CsvColumn<Row>{"recommended_q25", [](const Row& row) { return field(row.recommended.q25); }},
    CsvColumn<Row>{"recommended_q75", [](const Row& row) { return field(row.recommended.q75); }},
    CsvColumn<Row>{"recommended_lo95", [](const Row& row) { return field(row.recommended.interval.low); }},
    CsvColumn<Row>{"recommended_hi95", [](const Row& row) { return field(row.recommended.interval.high); }},
};

// After the statistics of kFinalStatistics.
constexpr std::array kNumbers = {
    CsvColumn<Row>{"commanded_median", [](const Row& row) { return field(row.commanded.median); }},
    CsvColumn<Row>{"commanded_q25", [](const Row& row) { return field(row.commanded.q25); }},
    CsvColumn<Row>{"commanded_q75", [](const Row& row) { return field(row.commanded.q75); }},
    CsvColumn<Row>{"commanded_lo95", [](const Row& row) { return field(row.commanded.interval.low); }},
    CsvColumn<Row>{"commanded_hi95", [](const Row& row) { return field(row.commanded.interval.high); }},
    CsvColumn<Row>{"measured_median", [](const Row& row) { return field(measured(row).median); }},
    CsvColumn<Row>{"measured_q25", [](const Row& row) { return field(measured(row).q25); }},
    CsvColumn<Row>{"measured_q75", [](const Row& row) { return field(measured(row).q75); }},
    CsvColumn<Row>{"in_spec", [](const Row& row) { return row.yield ? std::to_string(row.yield->in) : ""; }},
    CsvColumn<Row>{"in_spec_of", [](const Row& row) { return row.yield ? std::to_string(row.yield->n) : ""; }},
    CsvColumn<Row>{"yield", [](const Row& row) { return field(yield(row).share); }},
    CsvColumn<Row>{"yield_lo95", [](const Row& row) { return field(yield(row).interval.low); }},
    CsvColumn<Row>{"yield_hi95", [](const Row& row) { return field(yield(row).interval.high); }},
    CsvColumn<Row>{"yield_uncured", [](const Row& row) { return field(uncured(row).share); }},
    CsvColumn<Row>{"yield_uncured_lo95", [](const Row& row) { return field(uncured(row).interval.low); }},
    CsvColumn<Row>{"yield_uncured_hi95", [](const Row& row) { return field(uncured(row).interval.high); }},
    CsvColumn<Row>{"steps_to_spec", [](const Row& row) { return field(to_spec(row).steps); }},
    CsvColumn<Row>{"steps_to_spec_lo95", [](const Row& row) { return field(to_spec(row).interval.low); }},
    CsvColumn<Row>{"steps_to_spec_hi95", [](const Row& row) { return field(to_spec(row).interval.high); }},
    CsvColumn<Row>{"expected_steps_to_spec", [](const Row& row) { return field(to_spec(row).expected); }},
    CsvColumn<Row>{"seconds_to_spec", [](const Row& row) { return field(to_spec(row).seconds); }},
    CsvColumn<Row>{"machine_seconds_median", [](const Row& row) { return field(row.machine_seconds); }},
    CsvColumn<Row>{"algorithm_ms_per_step_median", [](const Row& row) { return field(row.algorithm_ms_per_step); }},
    CsvColumn<Row>{"mtf_centre_median", [](const Row& row) { return field(mtf(row).centre.median); }},
    CsvColumn<Row>{"mtf_corner_median", [](const Row& row) { return field(mtf(row).corner.median); }}};

// After those of the row.
constexpr std::array kSpecMtf = {
    CsvColumn<Group>{"spec_mtf_lp_per_mm", [](const Group& group) { return field(group.spec.lp_per_mm); }},
    CsvColumn<Group>{"spec_mtf_centre", [](const Group& group) { return field(group.spec.mtf_centre); }},
    CsvColumn<Group>{"spec_mtf_corner", [](const Group& group) { return field(group.spec.mtf_corner); }}};

// Per recommendation rule, prefixed with its name: own_median, best_yield.
constexpr std::array kOfRule = {
    CsvColumn<RuleScore>{"median", [](const RuleScore& score) { return field(score.median.estimate); }},
    CsvColumn<RuleScore>{"lo95", [](const RuleScore& score) { return field(score.median.interval.low); }},
    CsvColumn<RuleScore>{"hi95", [](const RuleScore& score) { return field(score.median.interval.high); }},
    CsvColumn<RuleScore>{"yield", [](const RuleScore& score) { return field(yield(score).share); }},
    CsvColumn<RuleScore>{"yield_lo95", [](const RuleScore& score) { return field(yield(score).interval.low); }},
    CsvColumn<RuleScore>{"yield_hi95", [](const RuleScore& score) { return field(yield(score).interval.high); }},
    CsvColumn<RuleScore>{"steps_to_spec", [](const RuleScore& score) { return field(score.steps); }}};

template <class Columns, class Source>
std::string fields(const Columns& columns, const Source& of) {
  std::string csv;
  for (const auto& column : columns) csv += ',' + column.text(of);
  return csv;
}

std::string band_fields(const statistics::Band& band) {
  return ',' + field(band.estimate) + ',' + field(band.interval.low) + ',' + field(band.interval.high);
}

std::string final_fields(const Row& row) {
  std::string csv;
  for (const statistics::Band& band : row.finals) csv += band_fields(band);
  return csv;
}

// The i-th further score: name and unit, median and interval.
std::string further_fields(const Group& group, const Row& row, std::size_t i) {
  const auto& declared = group.scored_by.further;
  return (i < declared.size() ? ',' + csv_field(declared[i].name) + ',' + csv_field(declared[i].unit) : ",,") +
         band_fields(i < row.further.size() ? row.further[i] : statistics::Band());
}

}  // namespace

std::string ranking_csv_head(const MoreColumns& more) {
  std::string csv =
      "results,scene,noise_level,protocol,algorithm,rank,ranked_by,oracle,trials,failed,step,"
      "start_median,own_optimum_median,spec_rmse";
  for (const auto& column : kRecommended) csv += std::string(",") + column.name;
  for (const statistics::FinalStatistic& one : statistics::kFinalStatistics)
    for (const char* end : {"", "_lo95", "_hi95"}) csv += std::string(",recommended_") + one.key + end;
  for (const auto& column : kNumbers) csv += std::string(",") + column.name;
  for (const auto& column : kSpecMtf) csv += std::string(",") + column.name;
  csv += ",rule,class,merit,method_key";
  for (const statistics::Rule rule : statistics::kRules)
    for (const auto& column : kOfRule) csv += std::string(",") + statistics::rule_name(rule) + "_" + column.name;
  csv += std::string(",trainings") + (more.cycle ? ",cycle_seconds_to_spec" : "") +
         (more.score ? ",score,score_unit" : "");
  for (std::size_t i = 1; i <= more.further; ++i)
    for (const char* end : {"", "_unit", "_median", "_lo95", "_hi95"})
      csv += ",further_score_" + std::to_string(i) + end;
  return csv + "\n";
}

std::string ranking_csv_rows(const PageModel& page, const std::string& folder, const MoreColumns& more) {
  std::string csv;
  for (const Group& group : page.groups) {
    std::size_t rank = 0;
    const std::string place = csv_field(folder) + ',' + csv_field(group.scene) + ',' + csv_field(group.noise_level) +
                              ',' + csv_field(group.protocol) + ',';
    for (const Row& row : group.rows) {
      ++rank;
      csv += place + csv_field(row.method) + ',' + (row.has_score() ? std::to_string(rank) : "") + ',' +
             (row.measured ? "measured" : "recommended") + ',' + (row.oracle() ? "true" : "false") + ',' +
             std::to_string(row.trials) + ',' + std::to_string(row.failed) + ',' + std::to_string(row.step) + ',' +
             field(group.start) + ',' + field(group.own_optimum) + ',' + field(group.spec.score) +
             fields(kRecommended, row) + final_fields(row) + fields(kNumbers, row) + fields(kSpecMtf, group) + ',' +
             statistics::rule_name(page.rule) + ',' + csv_field(class_name(row.of_class)) + ',' + csv_field(row.merit) +
             ',' + row.key;
      for (const RuleScore& score : row.rules.value_or(statistics::ByRule<RuleScore>()).values)
        csv += fields(kOfRule, score);
      csv += ',' + csv_field(row.training_tag) + (more.cycle ? ',' + field(to_spec(row).cycle) : "");
      if (more.score) csv += ',' + csv_field(group.scored_by.name) + ',' + csv_field(group.scored_by.unit);
      for (std::size_t i = 0; i < more.further; ++i) csv += further_fields(group, row, i);
      csv += '\n';
    }
  }
  return csv;
}

}  // namespace relign::report
