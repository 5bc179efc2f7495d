// The record of a trial: its structs, their columns, and how they are written to and read from lines of JSON.
// results/README.md describes the format. Readers refuse a newer format with an error.
//
// A new column is a member of its struct and a line of step_columns or trial_columns. Lines, fast reader, comparison,
// JSON Schema and the tables of results/README.md follow from that (CONTRIBUTING.md).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_source.h"
#include "base/pixel_region.h"
#include "records/rules.h"
#include "records/specification.h"

namespace relign::records {

inline constexpr int kFormat = 1;  // "format" in every file
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct StepRecord {
  unsigned step = 0;
  std::vector<double> commanded_pose;  // as requested, in the trial's coordinates
  std::vector<double> true_pose;
  std::uint64_t limits_low = 0, limits_high = 0;
  double merit = 0;
  double measured = 0;
  PixelRegions regions;
  double machine_seconds = 0;
  std::vector<double> recommended_pose;
  std::string recommendation;
  double recommended_seconds = 0;
  std::vector<double> recommended_true_pose;
  double commanded_mse = 0, commanded_mse_error = 0;
  double recommended_mse = 0, recommended_mse_error = 0;
};

// The lens's MTF at two field points, at the frequency of the specification. NaN where it does not ask for MTF.
struct MtfRecord {
  double centre = kUnknown, corner = kUnknown;
};

// The lens's own best pose, where its scene searches for it.
struct OwnOptimum {
  double mse = kUnknown;
  std::vector<double> pose;  // true pose, per axis as a fraction of the travel; empty: unknown
  MtfRecord mtf;
  std::vector<double> further_scores = {};  // there, in the order of the scene; empty if it declares none
};

struct StepErrors {  // one value per step
  std::vector<double> mse, error;
};

// Noise-free scores that are known when a trial has ended.
struct Scores {
  // At the last recommendation by a rule, before the glue cures. NaN where curing shifts nothing, for `best` where
  // the commanded pose alone decides where the lens is, and for `current`: both are the commanded_mse of a step.
  ByRule<double> uncured_mse = {{kUnknown, kUnknown, kUnknown}};
  // After curing, if the lens were fixed after each step. current: at the step's commanded pose; empty where curing
  // shifts nothing, because it equals the step's commanded_mse. best: after a move back to the pose of the lowest
  // measured RMSE so far; empty where the stage has no errors beyond the distortion, so that no pose depends on the
  // moves before. own: empty, it is the step's recommended_mse.
  ByRule<StepErrors> by_step;
  ByRule<ByCuring<MtfRecord>> mtf;  // at the last recommendation by the rule
};

struct TrialRecord {
  std::string trial;                                    // id
  std::string end;                                      // how it ended, see ended_well
  unsigned budget = 0;                                  // steps after step 0
  std::string scene, noise_level, protocol, algorithm;  // display names
  std::string algorithm_id;                             // plugin or preset
  std::string method, training;                         // set only for an entry of a suite's list of trainings
  std::uint64_t instance = 0;
  std::uint64_t instance_seed = 0;
  OwnOptimum own_optimum;
  Scores scores;
  // Of the criteria that the specification limits: one value per step, at its recommendation (NaN: not measurable).
  // Empty for the others.
  ByCriterion<std::vector<double>> criteria;
  // Where the specification limits MTF by field: the pose at which the worst field is farthest above its limit, and its
  // deficit there (negative). `criteria` of the pose refer to it instead of own_optimum.pose.
  std::vector<double> criterion_optimum_pose;
  double criterion_optimum_deficit = kUnknown;
  std::string message;                // the reason of a failure
  std::vector<std::string> warnings;  // side effects the plugin left behind in its process
  std::vector<StepRecord> steps;
};

// How a column is written and what it means.
struct Column {
  std::string_view key, unit, meaning;
  unsigned flags = 0;
  std::string_view one_of = {};  // the texts that it may have, separated by spaces; empty: any
  constexpr bool is(unsigned flag) const { return (flags & flag) != 0; }
};
enum ColumnFlag : unsigned {
  kOptional = 1,  // not written where empty or NaN; others are written as null if NaN
  kKnown = 2,     // never null
  kPerStep = 4,   // of a closing line: one value per step
  kAsText = 8,    // an integer as text, because many JSON readers lose precision of 64-bit integers
  kShare = 16,    // from 0 to 1
  kTabled = 32,   // a number: a column of instances.csv, of a step its value at the last one
  kLater = 64     // with kOptional: newer than some published results, which therefore need not have it in a replay
};

// Whether a line has the value although its column is optional.
template <class Value>
bool is_known(const Value& value) {
  if constexpr (std::is_same_v<Value, double>)
    return std::isfinite(value);
  else if constexpr (requires { value.empty(); })
    return !value.empty();
  return true;
}

// Call visit(column, member...) for every column in the order of the line, with the members of `steps`. Before them a
// line has its "trial".
template <class Visit, class... Step>
constexpr void step_columns(Visit&& visit, Step&... s) {
  visit(Column{"step", "", "0 is the capture at the start"}, s.step...);
  visit(Column{"commanded_pose", "travel", "as requested, for each axis", kKnown}, s.commanded_pose...);
  visit(Column{"true_pose", "travel", "for each axis; null where unknown"}, s.true_pose...);
  visit(Column{"limits_low", "", "bit i: axis i is at its lower limit"}, s.limits_low...);
  visit(Column{"limits_high", "", "bit i: axis i is at its upper limit"}, s.limits_high...);
  visit(Column{"merit", "", "as shown to the algorithm, if it observes the merit"}, s.merit...);
  visit(Column{"measured", "score",
               "of the capture: its RMSE against the reference, or the reading of the scene's score; null for a "
               "capture of regions"},
        s.measured...);
  visit(Column{"regions", "px", "column, row, columns and rows of what the capture reads out; absent for whole frames",
               kOptional},
        s.regions...);
  visit(Column{"machine_seconds", "s", "simulated, until the step was done", kTabled}, s.machine_seconds...);
  visit(Column{"recommended_pose", "travel", "commanded, for each axis; null where unknown"}, s.recommended_pose...);
  visit(Column{"recommendation", "", "whose it is: the algorithm's, or a default of the harness", 0,
               "own best_measured current"},
        s.recommendation...);
  visit(Column{"recommended_seconds", "s", "simulated, with the move to the recommended pose", kTabled},
        s.recommended_seconds...);
  visit(Column{"recommended_true_pose", "travel", "of the lens glued at the recommendation, for each axis"},
        s.recommended_true_pose...);
  visit(Column{"commanded_mse", "MSE or score",
               "noise-free, unbiased, signed; of a scene with another score than the RMSE that score"},
        s.commanded_mse...);
  visit(Column{"commanded_mse_error", "MSE", "standard error"}, s.commanded_mse_error...);
  visit(Column{"recommended_mse", "MSE", "noise-free, unbiased, signed, after curing"}, s.recommended_mse...);
  visit(Column{"recommended_mse_error", "MSE", "standard error"}, s.recommended_mse_error...);
}

// Columns with kTabled, all of them numbers: how many, the place of one among them, and their values.
inline constexpr std::size_t kTabledColumns = [] {
  std::size_t count = 0;
  step_columns([&count](const Column& column) { count += column.is(kTabled) ? 1 : 0; });
  return count;
}();
consteval std::size_t tabled_place(std::string_view key) {
  std::size_t place = kTabledColumns, count = 0;
  step_columns([&](const Column& column) {
    if (column.is(kTabled) && column.key == key) place = count;
    count += column.is(kTabled) ? 1 : 0;
  });
  return place < kTabledColumns ? place : throw "not a column with kTabled";
}
std::array<double, kTabledColumns> tabled_values(const StepRecord& step);

// Before them a closing line has "format", "trial", "end" and "steps", the number of its step lines.
template <class Visit, class... Trial>
void trial_columns(Visit&& visit, Trial&... t) {
  const auto mtf = [&](const std::string& key, const std::string& where, auto&... at) {
    constexpr unsigned kFlags = kOptional | kKnown | kShare;
    visit(Column{key + "centre", "", "MTF in the middle of the field, " + where, kFlags}, at.centre...);
    visit(Column{key + "corner", "", "MTF in the worst corner of the field, " + where, kFlags}, at.corner...);
  };
  const auto mtf_by = [&](Rule rule) {
    const std::string by = rule == Rule::own ? "" : std::string(rule_name(rule)) + "_";
    const std::string where = std::string("at the last recommendation by the rule ") + rule_name(rule);
    mtf(by + "mtf_", where + ", after curing", t.scores.mtf[rule][Curing::after]...);
    mtf(by + "uncured_mtf_", where + ", before the glue cures", t.scores.mtf[rule][Curing::before]...);
  };
  constexpr unsigned kSteps = kOptional | kPerStep;
  visit(Column{"budget", "", "steps that were allowed after step 0"}, t.budget...);
  visit(Column{"scene", "", "name in the suite"}, t.scene...);
  visit(Column{"noise_level", "", "name in the suite"}, t.noise_level...);
  visit(Column{"protocol", "", "what methods may observe", 0, "paper blind"}, t.protocol...);
  visit(Column{"algorithm", "", "name in the suite"}, t.algorithm...);
  visit(Column{"algorithm_id", "", "plugin or preset"}, t.algorithm_id...);
  visit(Column{"method", "", "name of the suite's list of trained networks; absent elsewhere", kOptional}, t.method...);
  visit(Column{"training", "", "which of the list's networks", kOptional}, t.training...);
  visit(Column{"instance", "", "number of the lens"}, t.instance...);
  visit(Column{"instance_seed", "", "64 bits; 0 in a sealed suite", kAsText}, t.instance_seed...);
  visit(Column{"own_optimum_mse", "MSE", "noise-free, at the lens's best pose; null where the scene finds none"},
        t.own_optimum.mse...);
  visit(Column{"own_optimum_pose", "travel", "true pose, for each axis; empty where unknown"}, t.own_optimum.pose...);
  mtf("own_optimum_mtf_", "at the lens's best pose", t.own_optimum.mtf...);
  visit(Column{"own_optimum_further_scores", "", "there, in the order of the scene", kOptional | kKnown},
        t.own_optimum.further_scores...);
  visit(Column{"uncured_mse", "MSE",
               "noise-free, at the last recommendation before the glue cures; absent where curing shifts nothing",
               kOptional | kKnown},
        t.scores.uncured_mse[Rule::own]...);
  mtf_by(Rule::own);
  visit(Column{"glued_mse", "MSE",
               "noise-free, of the lens cured at the step's commanded pose; absent where curing shifts nothing: there "
               "it equals commanded_mse",
               kSteps},
        t.scores.by_step[Rule::current].mse...);
  visit(Column{"glued_mse_error", "MSE", "standard errors", kSteps}, t.scores.by_step[Rule::current].error...);
  visit(Column{"best_mse", "MSE",
               "noise-free, of the lens after a move back to the pose of the lowest measured error so far, cured; "
               "absent where the stage has no errors beyond the distortion",
               kSteps},
        t.scores.by_step[Rule::best].mse...);
  visit(Column{"best_mse_error", "MSE", "standard errors", kSteps}, t.scores.by_step[Rule::best].error...);
  visit(Column{"best_uncured_mse", "MSE", "the last of best_mse before the glue cures", kOptional | kKnown},
        t.scores.uncured_mse[Rule::best]...);
  mtf_by(Rule::best);
  mtf_by(Rule::current);
  for (const Criterion criterion : kCriteria)
    visit(Column{entry_of(criterion).column, entry_of(criterion).unit, entry_of(criterion).meaning, kSteps},
          t.criteria[criterion]...);
  visit(
      Column{"criterion_optimum_pose", "travel", "true pose of the highest MTF of the worst field", kOptional | kKnown},
      t.criterion_optimum_pose...);
  visit(Column{"criterion_optimum_deficit", "", "field_mtf_deficit there", kOptional | kTabled},
        t.criterion_optimum_deficit...);
  visit(Column{"message", "", "why it failed"}, t.message...);
  visit(Column{"warnings", "", "side effects that a plugin left behind in its process"}, t.warnings...);
}

// Keys and values of a trial's columns with kTabled.
std::vector<std::pair<std::string, double>> tabled_values(const TrialRecord& trial);

// Whether it is one of the good ends of trial_ends.h.
bool ended_well(const std::string& end);

// SHA-256 of the three plugins that made a trial, and of the algorithm's pretrained file (empty: none). When one
// changes, its trials are run again.
struct PluginHashes {
  std::string scene, noise_level, algorithm, prepared = {};
  bool operator==(const PluginHashes& other) const {
    return scene == other.scene && noise_level == other.noise_level && algorithm == other.algorithm &&
           prepared == other.prepared;
  }
};

// Host times and plugin hashes: they differ between machines, and are kept apart so that equal trials have equal bytes.
struct TrialTimes {
  std::string trial;
  std::vector<double> algorithm_seconds, simulation_seconds, truth_seconds;  // one value per step
  PluginHashes plugins;
  // Of the whole trial: everything but algorithm and scene, that is stage, scoring, records and communication between
  // processes; and the writing of the previous trial, since a line cannot hold the time of its own writing. NaN:
  // unknown.
  double harness_seconds = kUnknown;
};

// One line per step, then the closing line, without a trailing newline. Numbers have the fewest digits
// that read back equal; non-finite numbers are written as null and read back as NaN.
std::string to_lines(const TrialRecord& record);
// The same in parts, without newlines.
std::string step_line(const std::string& trial, const StepRecord& step);
std::string closing_line(const TrialRecord& record, std::size_t steps);
std::string to_line(const TrialTimes& times);

// One line of a trials file: a step (with the trial it belongs to) or a closing line.
struct ReadLine {
  bool closing = false;
  TrialRecord trial;      // of a closing line: all but the steps; of a step: the id alone
  StepRecord step;        // of a step line
  std::size_t steps = 0;  // of a closing line: number of its step lines
};

// Throw Error(bad_input) for a damaged line, a missing member and one that is there twice, NewerFormat for a newer
// format. The text starts with `place` ("trials/0000.jsonl:7"), unless it is empty.
ReadLine read_trial_line(std::string_view line, const std::string& place);
TrialTimes read_times_line(std::string_view line, const std::string& place);

class NewerFormat : public Error {
 public:
  explicit NewerFormat(const std::string& message) : Error(ErrorKind::bad_input, message) {}
};

// The JSON of a file with a "format"; null where there is none. Throws Error(bad_input) where it is damaged,
// NewerFormat.
Json read_formatted(const std::filesystem::path& file);

// Throws Error(bad_input), for a newer format NewerFormat, unless "format" is one that this version reads. `what` names
// the file in the message.
void check_format(const Json& object, const std::string& what);

}  // namespace relign::records
