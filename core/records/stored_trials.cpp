#include "records/stored_trials.h"

#include <fstream>

#include "base/error.h"
#include "records/line_files.h"
#include "records/results_folder.h"

namespace relign::records {
namespace fs = std::filesystem;

void for_each_stored(const fs::path& folder, const std::function<void(const TrialRecord&, const StoredTrial&)>& visit) {
  require_results(folder);
  for (const fs::path& file : line_files(folder / "trials")) {
    const std::size_t number = std::stoul(file.stem().string());
    scan_trials(file, [&](const TrialRecord& closing, const BlockPlace& block) {
      visit(closing, {number, block.offset, block.size});
    });
  }
}

TrialRecord read_stored(const fs::path& folder, const StoredTrial& where, std::string* text) {
  const fs::path file = folder / "trials" / line_file_name(where.file);
  std::string lines(where.size, '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.seekg(static_cast<std::streamoff>(where.offset)) ||
      !stream.read(lines.data(), static_cast<std::streamsize>(lines.size())))
    throw Error(ErrorKind::io, "cannot read " + file.string() + "; did it change just now?");
  const Blocks split = split_trials(lines, file.string());
  if (split.blocks.size() != 1)
    throw Error(ErrorKind::io, file.string() + " changed while it was read; is a run writing it?");
  TrialRecord record = read_block(split.blocks[0], file.string());
  if (text) *text = std::move(lines);
  return record;
}

void for_each_times(const fs::path& folder, const std::function<void(const TrialTimes&)>& visit) {
  for (const fs::path& file : line_files(folder / "times")) {
    std::ifstream stream(file, std::ios::binary);
    std::string line;
    for (std::size_t number = 1; std::getline(stream, line) && !stream.eof(); ++number)
      visit(read_times_line(line, file.string() + ":" + std::to_string(number)));
  }
}

}  // namespace relign::records
