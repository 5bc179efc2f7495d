#include "base/files.h"
#include "records/line_files.h"
#include "records/results_folder.h"

namespace relign::records {
namespace fs = std::filesystem;

void require_folder(const fs::path& folder) {
  std::error_code code;
  if (fs::is_directory(folder, code)) return;
  throw Error(ErrorKind::io, "cannot read '" + folder.string() + "': " +
                                 (fs::exists(folder, code) ? "it is a file; expected a folder" : "no such folder"));
}

void require_results(const fs::path& folder) {
  require_folder(folder);
  std::error_code code;
  if (!fs::exists(folder / "manifest.json", code))
    throw Error(ErrorKind::bad_input, folder.string() + " is not a results folder: it has no manifest.json");
  if (!fs::exists(folder / "trials", code) && fs::exists(folder / "trials.new", code))
    throw Error(ErrorKind::bad_input, folder.string() +
                                          " belongs to a run that was interrupted while it wrote its records in order; "
                                          "resume that run first, by its command");
  // Without this check, a published study would look like one that has not begun, and its tables would be overwritten.
  if (!fs::exists(folder / "trials", code) && fs::exists(folder / "instances.csv", code))
    throw Error(ErrorKind::bad_input, folder.string() +
                                          " was published without its raw trials (it has no folder trials) and cannot "
                                          "be ranked, replayed or rewritten; see instances.csv and curves.csv for its "
                                          "numbers, or run its suite again");
  read_manifest_json(folder);  // refuses a newer format
}

TrialRecord read_block(const Block& block, const std::string& file) {
  TrialRecord record;
  std::vector<StepRecord> steps;
  std::size_t line_number = block.line;
  for (std::size_t at = 0; at < block.text.size(); ++line_number) {
    const std::size_t newline = block.text.find('\n', at);
    ReadLine line = read_trial_line(block.text.substr(at, newline - at), file + ":" + std::to_string(line_number));
    if (line.closing)
      record = std::move(line.trial);
    else
      steps.push_back(std::move(line.step));
    at = newline + 1;
  }
  record.steps = std::move(steps);
  return record;
}

std::vector<TrialRecord> read_trials(const fs::path& folder,
                                     const std::function<void(const std::string& trial)>& incomplete) {
  require_results(folder);
  std::vector<TrialRecord> trials;
  std::set<std::string> seen;
  std::vector<Damage> damaged;
  for (const fs::path& file : line_files(folder / "trials")) {
    const std::string text = read_file(file, kMaxRecordBytes);
    const Blocks split = split_trials(text, file.string());
    for (const Block& block : split.blocks)
      if (seen.insert(block.trial).second) trials.push_back(read_block(block, file.string()));
    damaged.insert(damaged.end(), split.damaged.begin(), split.damaged.end());
    if (incomplete)
      for (const std::string& trial : split.incomplete) incomplete(trial);
  }
  throw_if_damaged(damaged);
  return trials;
}

std::set<std::string> complete_trials(const fs::path& folder, std::vector<Damage>& damaged) {
  std::set<std::string> ids;
  for (const fs::path& file : line_files(folder / "trials"))
    scan_trials(file, damaged, [&ids](const TrialRecord& closing, const BlockPlace&) { ids.insert(closing.trial); });
  return ids;
}

std::vector<TrialTimes> read_times(const fs::path& folder) {
  require_results(folder);
  std::vector<TrialTimes> times;
  std::map<std::string, std::size_t> place;  // of a trial that ran again, the last line is the valid one
  for (const fs::path& file : line_files(folder / "times")) {
    const std::string text = read_file(file, kMaxRecordBytes);
    const Blocks split = split_times(text, file.string());
    throw_if_damaged(split.damaged);
    for (const Block& block : split.blocks) {
      TrialTimes read = read_times_line(block.text, file.string() + ":" + std::to_string(block.line));
      const auto [found, fresh] = place.emplace(block.trial, times.size());
      if (fresh)
        times.push_back(std::move(read));
      else
        times[found->second] = std::move(read);
    }
  }
  return times;
}

std::vector<TrialRecord> read_planned_trials(const fs::path& folder) {
  std::vector<TrialRecord> all = read_trials(folder);
  const Manifest manifest = manifest_of(folder);
  if (manifest.order.empty()) return all;
  std::map<std::string, std::size_t> place;
  for (std::size_t index = 0; index < all.size(); ++index) place.emplace(all[index].trial, index);
  std::vector<TrialRecord> planned;
  for (const std::string& id : manifest.order) {
    const auto found = place.find(id);
    if (found != place.end()) planned.push_back(std::move(all[found->second]));
  }
  return planned;
}

}  // namespace relign::records
