// The results folder: append-only while a run goes on, canonical when it is complete.
//
// Layout (results/README.md has the whole): manifest.json, trials/0000.jsonl ..., times/0000.jsonl ...,
// logs/, pictures/, scenes/<hash>/, aggregate.csv, curves.csv, curves.json, instances.csv, report.html. Trial number k of the
// plan goes into file k / 1000. A trial's lines are written in one go, closing line last: what has no
// closing line is no result. finish() puts every file into the plan's order, so that equal runs
// give equal bytes whatever the number of workers.
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

#include "records/record.h"
#include "records/results_lock.h"

namespace relign::records {

// What is known of a finished trial without reading its steps.
struct FinishedTrial {
  std::string scene, noise_level, protocol, algorithm;  // names shown
  std::string end;
  std::string message;
  std::uint64_t instance = 0;
  PluginHashes plugins;  // empty texts when times/ has no line of the trial
};

class ResultsWriter {
 public:
  // Creates the folder if need be, and holds its lock as long as this lives. A half-written tail of a
  // file is cut off. Throws Error(io) when the folder cannot be written or another process writes it,
  // Error(bad_input) when it holds something that is no results folder, or a newer format.
  explicit ResultsWriter(std::filesystem::path folder);

  const std::filesystem::path& folder() const { return folder_; }

  // Trials with a closing line.
  std::set<std::string> finished_trials() const;
  std::map<std::string, FinishedTrial> finished() const;
  // How many files had a half-written tail when the folder was opened.
  std::size_t repaired() const { return repaired_; }

  // Thread-safe. `place` is the trial's index in the plan. Throws Error(io) when the disk is full; then
  // the files are as they were.
  void append(std::size_t place, const TrialRecord& record, const TrialTimes& times);
  // The same when the step lines (each with its newline) are there already: the steps in `record` are not looked at.
  void append(std::size_t place, const TrialRecord& record, std::string_view step_lines, std::size_t steps,
              const TrialTimes& times);

  // What the trial's plugins printed, whole; an empty text removes the file of an earlier time. Before append: what is
  // finished has its log.
  void write_log(const std::string& trial, const std::string& text);

  // Drops the records and logs of these trials (a changed plugin), atomically per file.
  void drop(const std::set<std::string>& trials);

  // Sorts every file by the plan's order; trials not in `order` stay, after the others.
  void finish(const std::vector<std::string>& order);

  void write_manifest(const Json& manifest);
  Json read_manifest() const;  // null when there is none

 private:
  void append_lines(std::size_t place, const std::string& lines, const TrialRecord& record, const TrialTimes& times);

  std::filesystem::path folder_;
  ResultsLock lock_;
  mutable std::mutex mutex_;
  std::map<std::string, FinishedTrial> finished_;
  std::size_t repaired_ = 0;
  std::chrono::steady_clock::time_point flushed_{};
};

// Where the log of a trial lies in its folder: "logs/<trial id>.txt". No file when nothing was printed.
std::string log_file(const std::string& trial);

// Throws Error for what is no results folder, or a newer one.
void require_results(const std::filesystem::path& folder);

// manifest.json of a folder, format checked; null when there is none.
Json read_manifest(const std::filesystem::path& folder);

// Writes these trials' closing lines anew, each file at once; step lines stay as they are, byte for byte. Holds the
// folder's lock. Throws Error(io) when another process writes the folder, or it cannot be written.
void replace_closing_lines(const std::filesystem::path& folder, const std::map<std::string, TrialRecord>& records);

// Reads every complete trial of a folder, in file order. Throws Error for unreadable or newer files;
// calls `incomplete` for each trial that has steps but no closing line.
std::vector<TrialRecord> read_trials(const std::filesystem::path& folder,
                                     const std::function<void(const std::string& trial)>& incomplete = {});
// The ids alone. Nothing for a folder without records.
std::set<std::string> complete_trials(const std::filesystem::path& folder);
std::vector<TrialTimes> read_times(const std::filesystem::path& folder);

// The complete trials that the manifest's `order` names, in that order: what tables and reports are made
// of. A folder may also hold trials of an earlier form of the suite, which are kept but not shown.
std::vector<TrialRecord> read_planned_trials(const std::filesystem::path& folder);

}  // namespace relign::records
