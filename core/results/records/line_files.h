// The .jsonl files of a results folder as bytes: where each trial's block of lines begins and ends.
// Used inside this room; others read through results_folder.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "records/record.h"

namespace relign::records {

// How many trials of the plan go into one file.
inline constexpr std::size_t kTrialsPerFile = 1000;

// Of one file: a thousand trials of 100,000 steps have 60 GB, and are still read where there is the memory.
inline constexpr std::size_t kMostRecordBytes = std::size_t{100} << 30;

std::string line_file_name(std::size_t number);  // 0 -> "0000.jsonl"

// The folder's .jsonl files by number. Nothing when the folder does not exist.
std::vector<std::filesystem::path> line_files(const std::filesystem::path& folder);

// The lines of one trial, closing line last (in times/: its one line).
struct Block {
  std::string trial;
  std::string_view text;     // with every newline
  std::string_view closing;  // the last line without its newline
  std::size_t line = 0;      // of the file, from 1, where the block starts
};

struct Blocks {
  std::vector<Block> blocks;
  std::vector<std::string> incomplete;  // trials with steps but no closing line
  std::size_t whole = 0;                // bytes up to the end of the last block: the rest is half-written
};

// Views into `text`. Throws Error(bad_input) for lines that neither are steps nor close a trial, and
// for a closing line whose steps are not there; what stands after the last whole block is no error.
Blocks split_trials(std::string_view text, const std::string& file_name);
Blocks split_times(std::string_view text, const std::string& file_name);

// Finds the blocks of a trials file line by line, for texts and for files that are too large to be held.
class BlockFinder {
 public:
  explicit BlockFinder(std::string file_name) : file_name_(std::move(file_name)) {}
  // `line` without its newline begins at byte `offset` and is number `number`, from 1. True when it closes a trial.
  // Throws as split_trials does.
  bool add(std::string_view line, std::size_t offset, std::size_t number);
  // Where the block that was just closed begins, and the record on its closing line.
  std::size_t begin() const { return begin_; }
  // Step lines of the block that is open, the last one among them.
  std::size_t steps() const { return steps_; }
  std::size_t first_line() const { return first_line_; }
  const TrialRecord& closed() const { return closed_; }
  // After the last line: trials with steps but no closing line.
  std::vector<std::string> take_incomplete();

 private:
  void abandon();
  std::string file_name_;
  std::string trial_;  // of the steps before the line
  std::size_t steps_ = 0, begin_ = 0, first_line_ = 1;
  TrialRecord closed_;
  std::vector<std::string> incomplete_;
};

// Where a trial lies in a file.
struct BlockPlace {
  std::size_t offset = 0, size = 0;  // bytes, with every newline
};

// The blocks of a file, which is read a piece at a time: memory goes with its longest line. What stands after the
// last whole block is passed over; `on_incomplete` gets the trials that have steps but no closing line. `on_step` gets
// every step line without its newline, its number in the file and its place in the block, from 0; a block may begin
// anew before it is closed. Throws as split_trials does, and Error(io).
void scan_trials(const std::filesystem::path& file,
                 const std::function<void(const TrialRecord& closing, const BlockPlace&)>& on_trial,
                 const std::function<void(const std::string& trial)>& on_incomplete = {},
                 const std::function<void(std::string_view line, std::size_t number, std::size_t step)>& on_step = {});
// The lines of a times file by their trials; of a line only id and format are read.
void scan_times(const std::filesystem::path& file,
                const std::function<void(const std::string& trial, const BlockPlace&)>& on_trial);

// A trial's record from its block; errors name the line of the file.
TrialRecord read_block(const Block& block, const std::string& file);

// Appends `block` (may be empty) in one write and flushes the file to the disk when asked to. When that fails, the file
// is cut back to what it was. Throws Error(io). Returns the size before.
std::size_t append_block(const std::filesystem::path& file, std::string_view block, bool flush);
void cut_file(const std::filesystem::path& file, std::size_t size);

}  // namespace relign::records
