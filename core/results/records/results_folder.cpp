#include "records/results_folder.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <optional>
#include <utility>

#include "base/files.h"
#include "records/checksum.h"
#include "records/line_files.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// A results folder starts with the lock, then the manifest. A folder without a manifest that holds anything else is
// not ours to write into.
void refuse_foreign(const fs::path& folder) {
  if (!read_manifest_json(folder).is_null()) return;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    if (name == ResultsLock::kFileName || is_temporary_file(name)) continue;
    if ((name == "trials" || name == "times") && fs::is_directory(entry->path(), code) &&
        fs::is_empty(entry->path(), code))
      continue;
    throw Error(ErrorKind::bad_input, folder.string() + " is not a results folder: it contains '" + name +
                                          "' but no manifest.json; choose an empty or new folder with --out");
  }
  if (code) throw Error(ErrorKind::io, "cannot read '" + folder.string() + "': " + code.message());
}

fs::path prepared(fs::path folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) throw Error(ErrorKind::io, "cannot create the results folder '" + folder.string() + "': " + code.message());
  refuse_foreign(folder);
  return folder;
}

// finish() writes NAME.new, then moves NAME to NAME.old and NAME.new to NAME. After a crash between the two moves NAME
// is missing and NAME.new is complete.
void recover_swap(const fs::path& folder) {
  const fs::path fresh = folder.string() + ".new";
  std::error_code code;
  if (!fs::exists(folder, code) && fs::exists(fresh, code)) {
    fs::rename(fresh, folder, code);
    if (code) throw_cannot_write(folder, code);
  }
  fs::remove_all(fresh, code);
  fs::remove_all(folder.string() + ".old", code);
  fs::create_directories(folder, code);
  if (code) throw_cannot_write(folder, code);
}

void swap_in(const fs::path& folder) {
  const fs::path old = folder.string() + ".old";
  std::error_code code;
  fs::remove_all(old, code);
  fs::rename(folder, old, code);
  if (!code) fs::rename(folder.string() + ".new", folder, code);
  if (code) throw_cannot_write(folder, code);
  fs::remove_all(old, code);
}

using Splitter = Blocks (*)(std::string_view, const std::string&);

// The text of every trial's block, the last one where there are several; `order` lists trials by first appearance.
struct Collected {
  std::vector<std::string> order;
  std::map<std::string, std::string> text;
};

Collected collect(const fs::path& folder, Splitter split) {
  Collected all;
  for (const fs::path& file : line_files(folder)) {
    const std::string text = read_file(file, kMaxRecordBytes);
    const Blocks blocks = split(text, file.string());
    throw_if_damaged(blocks.damaged);  // since the folder was opened
    for (const Block& block : blocks.blocks) {
      const auto [found, fresh] = all.text.insert_or_assign(block.trial, std::string(block.text));
      if (fresh) all.order.push_back(block.trial);
    }
  }
  return all;
}

// Rewrites a folder of line files so that file k holds the trials 1000 k to 1000 k + 999 of the plan in order.
void arrange(const fs::path& folder, Splitter split, const std::vector<std::string>& places,
             const std::set<std::string>& keep) {
  const Collected all = collect(folder, split);
  std::map<std::size_t, std::string> files;
  for (std::size_t place = 0; place < places.size(); ++place) {
    const auto found = all.text.find(places[place]);
    if (found != all.text.end() && keep.count(places[place])) files[place / kTrialsPerFile] += found->second;
  }
  const std::vector<fs::path> present = line_files(folder);
  const bool equal =
      present.size() == files.size() && std::all_of(present.begin(), present.end(), [&files](const fs::path& file) {
        const auto wanted = files.find(std::stoul(file.stem().string()));
        return wanted != files.end() && wanted->second == read_file(file);
      });
  if (equal) return;
  const fs::path fresh = folder.string() + ".new";
  std::error_code code;
  fs::create_directories(fresh, code);
  if (code) throw_cannot_write(fresh, code);
  for (const auto& [number, text] : files) write_file_atomically(fresh / line_file_name(number), text);
  swap_in(folder);
}

// Removes the blocks of these trials, and damaged lines.
void remove_blocks(const fs::path& folder, Splitter split, const std::set<std::string>& trials) {
  for (const fs::path& file : line_files(folder)) {
    const std::string text = read_file(file, kMaxRecordBytes);
    std::string kept;
    for (const Block& block : split(text, file.string()).blocks)
      if (!trials.count(block.trial)) kept += block.text;
    if (kept == text) continue;
    std::error_code code;
    if (kept.empty()) {
      fs::remove(file, code);
      if (code) throw_cannot_write(file, code);
    } else {
      write_file_atomically(file, kept);
    }
  }
}

}  // namespace

double step_seconds(const TrialTimes& times) {
  double seconds = 0;
  for (const auto* of_step : {&times.algorithm_seconds, &times.simulation_seconds, &times.truth_seconds})
    seconds = std::accumulate(of_step->begin(), of_step->end(), seconds);
  return seconds;
}

double once_seconds(const TrialTimes& times) {
  const std::vector<double>& own = times.algorithm_seconds;
  if (own.size() < 3) return 0;
  const double all = std::accumulate(own.begin(), own.end(), 0.0), longest = *std::max_element(own.begin(), own.end());
  return longest > all / 2 ? longest - (all - longest) / static_cast<double>(own.size() - 1) : 0;
}

ResultsWriter::ResultsWriter(fs::path folder, OnDamage on_damage)
    : folder_(prepared(std::move(folder))), lock_(folder_) {
  recover_swap(folder_ / "trials");
  recover_swap(folder_ / "times");
  open_files(on_damage);
}

void ResultsWriter::open_files(OnDamage on_damage) {
  std::vector<std::pair<fs::path, std::size_t>> half_written;  // with the bytes to keep
  const auto for_each_block = [&](const char* name, Splitter split_text, const auto& body) {
    for (const fs::path& file : line_files(folder_ / name)) {
      const std::string text = read_file(file, kMaxRecordBytes);
      const Blocks split = split_text(text, file.string());
      dropped_.insert(dropped_.end(), split.damaged.begin(), split.damaged.end());
      for (const Block& block : split.blocks) body(file.string(), block);
      if (split.whole < text.size()) half_written.emplace_back(file, split.whole);
    }
  };
  for_each_block("trials", split_trials, [&](const std::string& file, const Block& block) {
    const TrialRecord trial = read_trial_line(block.closing, file).trial;
    finished_[block.trial] = {trial.scene, trial.noise_level, trial.protocol, trial.algorithm,
                              trial.end,   trial.message,     trial.instance};
  });
  for_each_block("times", split_times, [&](const std::string& file, const Block& block) {
    if (const auto found = finished_.find(block.trial); found != finished_.end()) {
      const TrialTimes times = read_times_line(block.closing, file);
      found->second.plugins = times.plugins;
      found->second.step_seconds = step_seconds(times);
      found->second.once_seconds = once_seconds(times);
    }
  });
  if (on_damage == OnDamage::refuse) throw_if_damaged(dropped_);
  repaired_ = half_written.size();
  for (const auto& [file, whole] : half_written) cut_file(file, whole);
  if (dropped_.empty()) return;
  remove_blocks(folder_ / "trials", split_trials, {});
  remove_blocks(folder_ / "times", split_times, {});
}

std::set<std::string> ResultsWriter::finished_trials() const {
  const std::lock_guard<std::mutex> hold(mutex_);
  std::set<std::string> ids;
  for (const auto& [id, trial] : finished_) ids.insert(id);
  return ids;
}

std::map<std::string, FinishedTrial> ResultsWriter::finished() const {
  const std::lock_guard<std::mutex> hold(mutex_);
  return finished_;
}

void ResultsWriter::append(std::size_t place, const TrialRecord& record, const TrialTimes& times) {
  append_lines(place, with_checksum(to_lines(record)) + "\n", record, times);
}

void ResultsWriter::append(std::size_t place, const TrialRecord& record, std::string_view step_lines, std::size_t steps,
                           const TrialTimes& times) {
  append_lines(place, with_checksum(std::string(step_lines) + closing_line(record, steps)) + "\n", record, times);
}

void ResultsWriter::append_lines(std::size_t place, const std::string& lines, const TrialRecord& record,
                                 const TrialTimes& times) {
  const std::string file = line_file_name(place / kTrialsPerFile);
  const std::string times_line = with_checksum(to_line(times)) + "\n";
  const std::lock_guard<std::mutex> hold(mutex_);
  // Times first: the closing line makes the trial a result, so that nothing of it may be missing then.
  const fs::path times_file = folder_ / "times" / file;
  const std::size_t before = append_block(times_file, times_line, false);
  try {
    // Flushed once a second: a crash of the program loses no written data, only a crash of the machine does; and a full
    // network disk reports its error at a flush.
    const auto now = std::chrono::steady_clock::now();
    const bool flush = now - flushed_ >= std::chrono::seconds(1);
    append_block(folder_ / "trials" / file, lines, flush);
    if (flush) flushed_ = now;
  } catch (const Error&) {
    cut_file(times_file, before);
    throw;
  }
  finished_[record.trial] = {record.scene,        record.noise_level, record.protocol, record.algorithm,
                             record.end,          record.message,     record.instance, times.plugins,
                             step_seconds(times), once_seconds(times)};
}

void ResultsWriter::write_log(const std::string& trial, const std::string& text) {
  const fs::path file = folder_ / log_file(trial);
  std::error_code code;
  if (!text.empty())
    write_file_atomically(file, text);
  else if (!fs::remove(file, code) && code)
    throw_cannot_write(file, code);
}

void ResultsWriter::drop(const std::set<std::string>& trials) {
  if (trials.empty()) return;
  const std::lock_guard<std::mutex> hold(mutex_);
  remove_blocks(folder_ / "trials", split_trials, trials);
  remove_blocks(folder_ / "times", split_times, trials);
  for (const std::string& trial : trials) {
    finished_.erase(trial);
    write_log(trial, "");
  }
}

void ResultsWriter::finish(const std::vector<std::string>& order) {
  const std::lock_guard<std::mutex> hold(mutex_);
  for (const char* name : {"trials", "times"})
    for (const fs::path& file : line_files(folder_ / name)) append_block(file, "", true);
  std::vector<std::string> places = order;
  std::set<std::string> planned(order.begin(), order.end());
  for (const std::string& trial : collect(folder_ / "trials", split_trials).order)
    if (planned.insert(trial).second) places.push_back(trial);
  std::set<std::string> keep;  // drops the times of trials without a record
  for (const auto& [id, trial] : finished_) keep.insert(id);
  arrange(folder_ / "trials", split_trials, places, keep);
  arrange(folder_ / "times", split_times, places, keep);
}

std::string log_file(const std::string& trial) { return "logs/" + trial + ".txt"; }

void ResultsWriter::write_manifest(const Manifest& manifest) {
  write_file_atomically(folder_ / "manifest.json",
                        json_of(manifest).dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace relign::records
