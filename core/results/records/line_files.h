// The .jsonl files of a results folder as bytes: where each trial's block of lines begins and ends.
// Internal to this module; others read through results_folder.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/hash.h"
#include "records/damage.h"
#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

// Trials of the plan per file.
inline constexpr std::size_t kTrialsPerFile = 1000;

// Largest file that is read whole. A thousand trials of 100,000 steps take 60 GB, and can be read where memory allows.
inline constexpr std::size_t kMaxRecordBytes = std::size_t{100} << 30;

std::string line_file_name(std::size_t number);  // 0 -> "0000.jsonl"

// The folder's .jsonl files by number; empty when the folder does not exist.
std::vector<std::filesystem::path> line_files(const std::filesystem::path& folder);

// What there is of another kind: links, which are read although they lead elsewhere, and .jsonl files of other names,
// which are not read. As sentences without full stop.
std::vector<std::string> odd_line_files(const std::filesystem::path& folder);

// The lines of one trial, closing line last (in times/: its one line).
struct Block {
  std::string trial;
  std::string_view text;     // with every newline
  std::string_view closing;  // the last line without its newline
  std::size_t line = 0;      // of the file, from 1, where the block starts
};

struct Blocks {
  std::vector<Block> blocks;
  std::vector<std::string> incomplete;  // trials with steps but no closing line, at the end
  std::vector<Damage> damaged;          // their lines are in no block
  std::size_t whole = 0;                // bytes up to the end of the last block or damage: the rest is half-written
};

// Views into `text`. Damaged are lines that are neither a step nor a closing line, closing lines whose steps are
// missing, steps without a closing line before a whole block, and blocks that do not have their checksum. Text after
// the last whole block is not damaged. Throws Error(bad_input) for a newer format.
Blocks split_trials(std::string_view text, const std::string& file_name);
Blocks split_times(std::string_view text, const std::string& file_name);

// Finds the blocks of a trials file line by line, in a text or in a file that is too large for memory.
class BlockFinder {
 public:
  explicit BlockFinder(std::string file_name) : file_name_(std::move(file_name)) {}
  enum class Line { step, closing, damaged };
  // `line`, without its newline, begins at byte `offset` and has the number `number`, from 1. Returns Line::closing
  // when it closes an undamaged trial. Throws as split_trials does.
  Line add(std::string_view line, std::size_t offset, std::size_t number);
  // Of the block closed last: its first byte, its first line, the record on its closing line, its number of step lines.
  std::size_t begin() const { return begin_; }
  std::size_t first_line() const { return first_line_; }
  const TrialRecord& closed() const { return closed_; }
  std::size_t closed_steps() const { return closed_steps_; }
  // Number of step lines of the open block, including the line added last.
  std::size_t steps() const { return steps_; }
  // Call after the last line. Returns the trials with steps but no closing line, and the damage found.
  std::vector<std::string> take_incomplete();
  std::vector<Damage> take_damaged() { return std::move(damaged_); }

 private:
  void begin_block(std::size_t offset, std::size_t number);
  void abandon();
  Line close(std::string_view line, std::size_t offset, std::size_t number, ReadLine closing);
  Line damage(std::size_t number, std::string trial, std::string what);
  std::string file_name_;
  std::string trial_;  // of the steps before the line
  std::size_t steps_ = 0, begin_ = 0, first_line_ = 1;
  std::size_t unreadable_ = 0;  // a line of the open block; 0: none
  std::string why_unreadable_;
  Sha256 hash_;  // of the open block
  TrialRecord closed_;
  std::size_t closed_steps_ = 0;
  std::vector<Damage> unclosed_;  // trials without a closing line, at the end of the file if none closes after them
  std::vector<Damage> damaged_;
};

// Where a trial's block is in a file.
struct BlockPlace {
  std::size_t offset = 0, size = 0;  // bytes, with every newline
  std::size_t line = 0;              // number of the first, from 1
  std::size_t steps = 0;             // lines before the closing one
};

// Calls `on_trial` for every block of a file. Reads line by line: memory grows with the longest line. Ignores what
// follows the last whole block; `on_incomplete` gets the trials that have steps but no closing line. `on_step` gets
// every step line without its newline, its line number and its index in the block, from 0; the index restarts when a
// block is abandoned or damaged. Appends to `damaged`. Throws as split_trials does, and Error(io).
void scan_trials(const std::filesystem::path& file, std::vector<Damage>& damaged,
                 const std::function<void(const TrialRecord& closing, const BlockPlace&)>& on_trial,
                 const std::function<void(const std::string& trial)>& on_incomplete = {},
                 const std::function<void(std::string_view line, std::size_t number, std::size_t step)>& on_step = {});
// Calls `on_trial` for every undamaged line of a times file; reads only the id and the format of a line.
void scan_times(const std::filesystem::path& file, std::vector<Damage>& damaged,
                const std::function<void(const std::string& trial, const BlockPlace&)>& on_trial);

// What is wrong with a line of times/; nullopt: nothing. Throws Error(bad_input) for a newer format.
std::optional<Damage> damaged_times(std::string_view line, const std::string& file_name, std::size_t number);

// Reads a trial's record from its block. Errors name the line of the file.
TrialRecord read_block(const Block& block, const std::string& file);

// Appends `block` (may be empty) in one write, and flushes the file to the disk if `flush`. On failure cuts the file
// back to its former size and throws Error(io). Returns the former size.
std::size_t append_block(const std::filesystem::path& file, std::string_view block, bool flush);
void cut_file(const std::filesystem::path& file, std::size_t size);

}  // namespace relign::records
