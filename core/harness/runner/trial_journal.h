// The journal of a running trial: a worker's process writes it to a file in memory that its coordinator holds, so that
// finished steps survive the worker's death.
//
// One entry per line: 'S' and a step's line as in trials/, 'T' and the step's host times, 'L' and a piece of the log
// with escaped line ends.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "records/record.h"

namespace relign::runner {

// Thread-safe, because a plugin may log from any thread.
class JournalWriter {
 public:
  explicit JournalWriter(int file) : file_(file) {}
  void begin();
  void add_step(const std::string& trial, const records::StepRecord& step, double algorithm_seconds,
                double simulation_seconds, double truth_seconds);
  void add_log(std::string_view text);
  void write_text(const std::string& text);  // instead of entries: a text that is too long for a message
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

// With `checked`, parses every step line and ignores everything from the first invalid one, which a dying process may
// leave. Without it, takes lines unchecked: the caller compares size and digest.
Journal read_journal(int file, const std::string& trial, bool checked);

// Counts the step lines of a journal that is being written.
class StepCounter {
 public:
  std::size_t count(int file);

 private:
  std::uint64_t size_ = 0;  // read so far
  char before_ = '\n';      // the last byte read
  std::size_t steps_ = 0;
};

struct JournalText {
  std::string text;
  std::uint64_t digest = 0;
};
JournalText read_journal_text(int file);

}  // namespace relign::runner
