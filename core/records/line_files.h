// The .jsonl files of a results folder as bytes: where each trial's block of lines begins and ends.
// Used inside this room; others read through results_folder.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace relign::records {

// How many trials of the plan go into one file.
inline constexpr std::size_t kTrialsPerFile = 1000;

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

// Appends `block` (may be empty) in one write and flushes the file to the disk when asked to. When that fails, the file
// is cut back to what it was. Throws Error(io). Returns the size before.
std::size_t append_block(const std::filesystem::path& file, std::string_view block, bool flush);
void cut_file(const std::filesystem::path& file, std::size_t size);

}  // namespace relign::records
