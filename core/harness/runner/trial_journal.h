// What a worker's process writes of a trial while it goes on, in a file in memory that its coordinator holds: when the
// worker dies, the steps it had finished are there.
//
// One line an entry: 'S' and a step's line as it will stand in trials/, 'T' and the step's host times, 'L' and a piece
// of the log with its line ends escaped.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "records/record.h"

namespace relign::runner {

// Any thread: a plugin may log from its own.
class JournalWriter {
 public:
  explicit JournalWriter(int file) : file_(file) {}
  void begin();
  void add_step(const std::string& trial, const records::StepRecord& step, double algorithm_seconds,
                double simulation_seconds, double truth_seconds);
  void add_log(std::string_view text);
  void write_text(const std::string& text);  // instead of entries: what is too long for a message
  std::uint64_t size() const { return size_; }
  std::uint64_t digest() const { return digest_; }  // of all bytes (FNV-1a)

 private:
  void write(const std::string& line);
  int file_;
  std::mutex mutex_;
  std::uint64_t size_ = 0, digest_ = 0;
};

struct Journal {
  std::string step_lines;  // each with its newline
  std::size_t steps = 0;
  records::TrialTimes times;  // plugin hashes not filled in
  std::string log;
  std::uint64_t size = 0, digest = 0;
};

void clear_journal(int file);

// `checked`: every step line is read, and what follows the first that is no step of this trial is left out, as what a
// dying process may leave. Else lines are taken as they are: compare size and digest.
Journal read_journal(int file, const std::string& trial, bool checked);

struct JournalText {
  std::string text;
  std::uint64_t digest = 0;
};
JournalText read_journal_text(int file);

}  // namespace relign::runner
