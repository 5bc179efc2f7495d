// The results folder: append-only during a run, canonical when it is complete.
//
// Layout (described in results/README.md): manifest.json, trials/0000.jsonl ..., times/0000.jsonl ...,
// logs/, pictures/, scenes/<hash>/, aggregate.csv, costs.csv, curves.csv, curves.json, instances.csv, matrix.csv,
// report.html. Trial number k of the plan goes into file k / 1000. A trial's lines are appended in one write, closing
// line last; a trial without a closing line does not count. finish() sorts every file by the plan, so that equal runs
// give equal bytes for any number of workers.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "records/damage.h"
#include "records/manifest.h"
#include "records/record.h"
#include "records/results_lock.h"

namespace relign::records {

// Host time of all steps.
double step_seconds(const TrialTimes& times);
// Of these, what a single step of the algorithm took longer than its others, where that is most of its time: it looks
// like a preparation for later trials too.
double once_seconds(const TrialTimes& times);

// Summary of a finished trial, without its steps.
struct FinishedTrial {
  std::string scene, noise_level, protocol, algorithm;  // display names
  std::string end;
  std::string message;
  std::uint64_t instance = 0;
  // Empty strings and NaN when times/ has no line of the trial.
  PluginHashes plugins = {};
  double step_seconds = kUnknown, once_seconds = 0;  // see the functions
};

class ResultsWriter {
 public:
  enum class OnDamage { refuse, drop };
  // Creates the folder if needed and locks it for the lifetime of the writer. Cuts half-written tails off files.
  // Throws Error(io) when the folder cannot be written or another process is writing it, Error(bad_input) when it is
  // not a results folder or has a newer format, and for damage, with the files as they were; with OnDamage::drop it
  // removes damaged blocks and lines.
  explicit ResultsWriter(std::filesystem::path folder, OnDamage on_damage = OnDamage::refuse);

  const std::filesystem::path& folder() const { return folder_; }

  // Trials with a closing line.
  std::set<std::string> finished_trials() const;
  std::map<std::string, FinishedTrial> finished() const;
  // Number of files whose half-written tail was cut off when the folder was opened.
  std::size_t repaired() const { return repaired_; }
  // What was dropped when the folder was opened.
  const std::vector<Damage>& dropped() const { return dropped_; }

  // Thread-safe. `place` is the trial's index in the plan. Throws Error(io), for example when the disk is full, and
  // leaves the files as they were.
  void append(std::size_t place, const TrialRecord& record, const TrialTimes& times);
  // The same for step lines that exist already (each with its newline); ignores the steps in `record`.
  void append(std::size_t place, const TrialRecord& record, std::string_view step_lines, std::size_t steps,
              const TrialTimes& times);

  // Replaces the log of the trial: what its plugins printed. An empty text removes the file. Call it before append, so
  // that a finished trial has its log.
  void write_log(const std::string& trial, const std::string& text);

  // Removes the records and logs of these trials (after a plugin changed), atomically per file.
  void drop(const std::set<std::string>& trials);

  // Sorts every file by the plan's order. Trials that are not in `order` are kept, after the others.
  void finish(const std::vector<std::string>& order);

  void write_manifest(const Manifest& manifest);

 private:
  void open_files(OnDamage on_damage);
  void append_lines(std::size_t place, const std::string& lines, const TrialRecord& record, const TrialTimes& times);

  std::filesystem::path folder_;
  ResultsLock lock_;
  mutable std::mutex mutex_;
  std::map<std::string, FinishedTrial> finished_;
  std::size_t repaired_ = 0;
  std::vector<Damage> dropped_;
  std::chrono::steady_clock::time_point flushed_{};
};

// Path of a trial's log within the folder: "logs/<trial id>.txt". The file does not exist when nothing was printed.
std::string log_file(const std::string& trial);

// Throws Error unless `folder` is a results folder of a format that this version reads.
void require_results(const std::filesystem::path& folder);
// Throws Error(io) unless this is a folder.
void require_folder(const std::filesystem::path& folder);

// Reads every complete trial of a folder, in file order. Throws Error for unreadable, damaged or newer files;
// calls `incomplete` for each trial that has steps but no closing line.
std::vector<TrialRecord> read_trials(const std::filesystem::path& folder,
                                     const std::function<void(const std::string& trial)>& incomplete = {});
// Their ids; empty for a folder without records. Appends to `damaged`.
std::set<std::string> complete_trials(const std::filesystem::path& folder, std::vector<Damage>& damaged);
std::vector<TrialTimes> read_times(const std::filesystem::path& folder);

// The complete trials that the manifest's `order` names, in that order: the input of tables and reports.
// A folder may also hold trials of an earlier version of the suite; they are kept but not shown.
std::vector<TrialRecord> read_planned_trials(const std::filesystem::path& folder);

}  // namespace relign::records
