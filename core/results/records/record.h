// What is written of a trial, and how it reads back. The format is described in results/README.md;
// this header is its C++ form. Readers refuse a newer format with a word.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_source.h"

namespace relign::records {

inline constexpr int kFormat = 1;  // "format" in every file

struct StepRecord {
  unsigned step = 0;
  std::vector<double> commanded_pose;
  std::vector<double> true_pose;
  std::uint64_t limits_low = 0;
  std::uint64_t limits_high = 0;
  double merit = 0;
  double measured = 0;  // RMSE of the capture against O*
  double machine_seconds = 0;
  std::vector<double> recommended_pose;
  std::string recommendation;  // "own", "best_measured", "current"
  double recommended_seconds = 0;
  std::vector<double> recommended_true_pose;
  double commanded_mse = 0, commanded_mse_error = 0;  // truth, signed, with standard error
  double recommended_mse = 0, recommended_mse_error = 0;
};

// The lens's MTF at points of the field, at the frequency of the specification; NaN, and not written, where nobody
// asked.
struct MtfRecord {
  double centre = std::numeric_limits<double>::quiet_NaN(), corner = centre;
};

struct TrialRecord {
  std::string trial;                                    // id
  std::string scene, noise_level, protocol, algorithm;  // names shown
  std::string algorithm_id;                             // plugin or preset
  std::string method, training;                         // of a suite's list of trainings; empty, and not written, else
  std::uint64_t instance = 0;
  std::uint64_t instance_seed = 0;
  std::string end;      // how it ended, see ended_well
  std::string message;  // why it failed
  unsigned budget = 0;
  double own_optimum_mse = 0;
  bool has_own_optimum = false;
  std::vector<double> own_optimum_pose;  // true pose, a share of the travel an axis; empty: not known
  // Noise-free, at the last recommendation before the glue cures; NaN, and not written, where that shifts nothing.
  double uncured_mse = std::numeric_limits<double>::quiet_NaN();
  // Noise-free, a value a step, where gluing at its commanded pose would leave the lens; not written where the glue
  // shifts nothing: then it is the step's commanded_mse. Records from before it was written have none either.
  std::vector<double> glued_mse, glued_mse_error;
  // At the last recommendation where the glue leaves the lens, before it cures, and at the lens's own best pose.
  MtfRecord mtf, uncured_mtf, own_optimum_mtf;
  // The same at the step of the lowest measured RMSE, and at the last step.
  MtfRecord best_mtf, best_uncured_mtf, current_mtf, current_uncured_mtf;
  std::vector<std::string> warnings;  // what the plugin left behind
  std::vector<StepRecord> steps;
};

// Whether the noise-free scores of the rules "best" and "current" cannot be had from the record: it is of an earlier
// program, and its glue shifts the lens or its specification asks for MTF. `closing` may be without steps.
bool lacks_rules(const TrialRecord& closing);

// `is` without what only a later program records, where `was` is of an earlier one: for comparing their bytes.
TrialRecord as_recorded_then(const TrialRecord& was, TrialRecord is);

// "budget_spent" or "finished". Every other end is a failure, with the steps made until then as a censored record:
// "failed" (a plugin said so), "crashed(SIGSEGV)", "crashed(exit 0)", "timeout", "out_of_memory", "protocol_error",
// "overspent" (went on asking for steps after the last).
bool ended_well(const std::string& end);

// SHA-256 of the three plugins that made a trial, and of what was prepared for its algorithm (empty: nothing): when one
// changes, its trials are run again.
struct PluginHashes {
  std::string scene, noise_level, algorithm, prepared = {};
  bool operator==(const PluginHashes& other) const {
    return scene == other.scene && noise_level == other.noise_level && algorithm == other.algorithm &&
           prepared == other.prepared;
  }
};

// What differs from host to host, kept apart from the record so that equal trials have equal bytes.
struct TrialTimes {
  std::string trial;
  std::vector<double> algorithm_seconds, simulation_seconds, truth_seconds;  // one value a step
  PluginHashes plugins;
  // Of the whole trial: what was neither algorithm nor scene, that is stage, scores, records, and the way between
  // processes; and the writing of the trial before, since a line cannot hold the time of its own writing. NaN: not
  // known.
  double harness_seconds = std::numeric_limits<double>::quiet_NaN();
};

// One line a step, then the closing line; no trailing newline on the last. Numbers are the shortest
// that read back equal; what is not finite is written as null and reads back as NaN.
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
  std::size_t steps = 0;  // of a closing line: how many step lines belong to it
};

// Throw Error(bad_input) that starts with `place` ("trials/0000.jsonl:7") for a damaged line, a missing
// member or a newer format.
ReadLine read_trial_line(std::string_view line, const std::string& place);
TrialTimes read_times_line(std::string_view line, const std::string& place);

// Refuses a format that this program does not know. `what` names the file.
void check_format(const Json& object, const std::string& what);

}  // namespace relign::records
