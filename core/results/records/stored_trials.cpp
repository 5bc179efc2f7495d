#include "records/stored_trials.h"

#include <fstream>
#include <iterator>
#include <optional>

#include "base/error.h"
#include "records/line_files.h"
#include "records/results_folder.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// Hands damage over to the caller, or throws it.
void report(std::vector<Damage> found, std::vector<Damage>* damaged) {
  if (damaged == nullptr) return throw_if_damaged(found);
  damaged->insert(damaged->end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
}

}  // namespace

void for_each_with_steps(
    const fs::path& folder,
    const std::function<void(const TrialRecord&, const StoredTrial&, const std::vector<StepNumbers>&)>& visit,
    const std::function<void(const std::string&)>& on_incomplete, std::vector<Damage>* damaged) {
  require_results(folder);
  StepNumbersReader reader;
  std::vector<StepNumbers> steps;
  std::vector<Damage> found;
  std::optional<Damage> unreadable;  // of the open block
  for (const fs::path& file : line_files(folder / "trials")) {
    const std::size_t number = std::stoul(file.stem().string());
    const std::string name = file.string();
    steps.clear();
    scan_trials(
        file, found,
        [&](const TrialRecord& closing, const BlockPlace& block) {
          if (unreadable && block.steps > 0) {  // and its checksum was made of that
            found.push_back(*unreadable);
            found.back().trial = closing.trial;
          } else {
            if (block.steps == 0) steps.clear();  // those of a damaged block before it
            set_scores(closing, steps);
            visit(closing, {number, block.offset, block.size, block.line}, steps);
          }
          steps.clear();
        },
        on_incomplete,
        [&](std::string_view line, std::size_t line_number, std::size_t step) {
          if (step == 0) unreadable.reset();
          steps.resize(step);  // drops the steps of an abandoned or damaged block
          try {
            steps.push_back(reader.read(line, ""));
          } catch (const Error& error) {
            steps.emplace_back();
            if (!unreadable) unreadable = Damage{name, line_number, "", error.what()};
          }
        });
  }
  report(std::move(found), damaged);
}

const std::vector<StepNumbers>& StoredSteps::read(const StoredTrial& where) {
  const fs::path file = folder_ / "trials" / line_file_name(where.file);
  if (file_ != where.file) {
    stream_ = std::ifstream(file, std::ios::binary);
    file_ = where.file;
  }
  lines_.resize(where.size);
  if (!stream_.seekg(static_cast<std::streamoff>(where.offset)) ||
      !stream_.read(lines_.data(), static_cast<std::streamsize>(lines_.size())) || lines_.empty() ||
      lines_.back() != '\n')
    throw Error(ErrorKind::io, "cannot read '" + file.string() + "' again; is a run writing it?");
  steps_.clear();
  const std::string_view lines = lines_;
  const std::size_t closing = lines.rfind('\n', lines.size() - 2);
  for (std::size_t at = 0; closing != std::string_view::npos && at < closing;) {
    const std::size_t newline = lines.find('\n', at);
    steps_.push_back(reader_.read(lines.substr(at, newline - at), file.string()));
    at = newline + 1;
  }
  closing_ = read_trial_line(lines.substr(closing == std::string_view::npos ? 0 : closing + 1), file.string()).trial;
  set_scores(closing_, steps_);
  return steps_;
}

TrialRecord read_stored(const fs::path& folder, const StoredTrial& where, std::string* text) {
  const fs::path file = folder / "trials" / line_file_name(where.file);
  std::string lines(where.size, '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.seekg(static_cast<std::streamoff>(where.offset)) ||
      !stream.read(lines.data(), static_cast<std::streamsize>(lines.size())))
    throw Error(ErrorKind::io, "cannot read '" + file.string() + "'; is a run writing it?");
  Blocks split = split_trials(lines, file.string());
  throw_if_damaged(split.damaged);
  if (split.blocks.size() != 1)
    throw Error(ErrorKind::io, file.string() + " changed while it was read; is a run writing it?");
  split.blocks[0].line = where.line;
  TrialRecord record = read_block(split.blocks[0], file.string());
  if (text) *text = std::move(lines);
  return record;
}

void for_each_times(const fs::path& folder, const std::function<void(const TrialTimes&)>& visit,
                    std::vector<Damage>* damaged) {
  std::vector<Damage> found;
  for (const fs::path& file : line_files(folder / "times")) {
    std::ifstream stream(file, std::ios::binary);
    std::string line;
    for (std::size_t number = 1; std::getline(stream, line) && !stream.eof(); ++number) {
      if (std::optional<Damage> damage = damaged_times(line, file.string(), number))
        found.push_back(std::move(*damage));
      else
        visit(read_times_line(line, ""));
    }
  }
  report(std::move(found), damaged);
}

}  // namespace relign::records
