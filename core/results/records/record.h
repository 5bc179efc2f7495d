// The record of a trial: its structs, and how they are written to and read from lines of JSON. results/README.md
// describes the format. Readers refuse a newer format with an error.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/json_source.h"
#include "base/pixel_region.h"
#include "records/specification.h"

namespace relign::records {

inline constexpr int kFormat = 1;  // "format" in every file

struct StepRecord {
  unsigned step = 0;
  std::vector<double> commanded_pose;
  std::vector<double> true_pose;
  std::uint64_t limits_low = 0;
  std::uint64_t limits_high = 0;
  double merit = 0;
  double measured = 0;   // RMSE of the capture against O*; NaN for one of regions
  PixelRegions regions;  // that the capture reads out; empty, and not written: all pixels
  double machine_seconds = 0;
  std::vector<double> recommended_pose;
  std::string recommendation;  // "own", "best_measured", "current"
  double recommended_seconds = 0;
  std::vector<double> recommended_true_pose;
  double commanded_mse = 0, commanded_mse_error = 0;  // noise-free, signed, with standard error
  double recommended_mse = 0, recommended_mse_error = 0;
};

// The lens's MTF at two field points, at the frequency of the specification. NaN, and not written, where the
// specification does not ask for MTF.
struct MtfRecord {
  double centre = std::numeric_limits<double>::quiet_NaN(), corner = centre;
};

struct TrialRecord {
  std::string trial;                                    // id
  std::string scene, noise_level, protocol, algorithm;  // display names
  std::string algorithm_id;                             // plugin or preset
  std::string method, training;  // set, and written, only for an entry of a suite's list of trainings
  std::uint64_t instance = 0;
  std::uint64_t instance_seed = 0;
  std::string end;      // how it ended, see ended_well
  std::string message;  // the reason of a failure
  unsigned budget = 0;
  double own_optimum_mse = 0;
  bool has_own_optimum = false;
  std::vector<double> own_optimum_pose;  // true pose, per axis as a fraction of the travel; empty: unknown
  // Noise-free, at the last recommendation before the glue cures. NaN, and not written, where curing shifts nothing.
  double uncured_mse = std::numeric_limits<double>::quiet_NaN();
  // Noise-free, one value per step: after curing, if the lens were fixed at that step's commanded pose. Not written
  // where curing shifts nothing, because it equals the step's commanded_mse.
  std::vector<double> glued_mse, glued_mse_error;
  // Noise-free, one value per step: after a move back to the pose of the lowest measured RMSE so far, and curing.
  // Written only where the stage has errors beyond the distortion, so that a pose depends on the moves before.
  std::vector<double> best_mse, best_mse_error;
  double best_uncured_mse = std::numeric_limits<double>::quiet_NaN();  // the last before curing; not written if NaN
  // At the last recommendation after curing, at the same before curing, and at the lens's own best pose.
  MtfRecord mtf, uncured_mtf, own_optimum_mtf;
  // The first two at the step of the lowest measured RMSE, and at the last step.
  MtfRecord best_mtf, best_uncured_mtf, current_mtf, current_uncured_mtf;
  // Of the criteria that the specification limits: one value per step, at its recommendation (NaN: not measurable).
  // Empty, and not written, for the others.
  ByCriterion<std::vector<double>> criteria;
  // Where the specification limits MTF by field: the pose at which the worst field is farthest above its limit, and its
  // deficit there (negative). `criteria` of the pose refer to it instead of own_optimum_pose.
  std::vector<double> criterion_optimum_pose;
  double criterion_optimum_deficit = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::string> warnings;  // side effects the plugin left behind in its process
  std::vector<StepRecord> steps;
};

// "budget_spent" or "finished". Every other end is a failure, with the steps made until then as a censored record:
// "failed" (reported by a plugin), "crashed(SIGSEGV)", "crashed(exit 0)", "crashed(sandbox)" (beyond its limits),
// "timeout", "out_of_memory", "protocol_error", "overspent" (kept asking for steps after the last one).
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
  double harness_seconds = std::numeric_limits<double>::quiet_NaN();
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

// Throws Error(bad_input), for a newer format NewerFormat, unless "format" is one that this version reads. `what` names
// the file in the message.
void check_format(const Json& object, const std::string& what);

}  // namespace relign::records
