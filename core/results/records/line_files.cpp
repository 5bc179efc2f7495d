#include "records/line_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "base/error.h"
#include "records/record.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view kStepStart = "{\"trial\":\"";

// "0000.jsonl" -> 0; false for any other name.
bool file_number(const fs::path& file, std::size_t& number) {
  const std::string stem = file.stem().string();
  if (file.extension() != ".jsonl" || stem.empty() || stem.size() > 9) return false;
  if (stem.find_first_not_of("0123456789") != std::string::npos) return false;
  number = std::stoul(stem);
  return true;
}

// Reads id and number of a step line from its first bytes, which to_lines always writes in the same form: parsing every
// step of a large folder only to find its blocks would take minutes.
bool step_line(std::string_view line, std::string_view& trial, bool& first) {
  if (line.substr(0, kStepStart.size()) != kStepStart) return false;
  line.remove_prefix(kStepStart.size());
  const std::size_t quote = line.find('"');
  if (quote == std::string_view::npos) return false;
  trial = line.substr(0, quote);
  constexpr std::string_view zero = "\",\"step\":0,";
  first = line.substr(quote, zero.size()) == zero;
  return true;
}

}  // namespace

std::string line_file_name(std::size_t number) {
  const std::string digits = std::to_string(number);
  return std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits + ".jsonl";
}

std::vector<fs::path> line_files(const fs::path& folder) {
  std::vector<std::pair<std::size_t, fs::path>> found;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    std::size_t number = 0;
    if (file_number(entry->path(), number)) found.emplace_back(number, entry->path());
  }
  if (code && code != std::errc::no_such_file_or_directory)
    throw Error(ErrorKind::io, "cannot read '" + folder.string() + "': " + code.message());
  std::sort(found.begin(), found.end());
  std::vector<fs::path> files;
  for (auto& [number, path] : found) files.push_back(std::move(path));
  return files;
}

bool BlockFinder::add(std::string_view line, std::size_t offset, std::size_t number) {
  std::string_view step_of;
  bool first = false;
  if (step_line(line, step_of, first)) {
    if (steps_ == 0 || step_of != trial_ || first) {
      abandon();
      trial_ = step_of;
      begin_ = offset;
      first_line_ = number;
    }
    ++steps_;
    return false;
  }
  const std::string place = file_name_ + ":" + std::to_string(number);
  ReadLine closing = read_trial_line(line, place);
  if (!closing.closing)
    throw Error(ErrorKind::bad_input, place + ": the line is damaged: expected a step or a closing line");
  if (steps_ > 0 && closing.trial.trial != trial_) abandon();
  if (steps_ == 0) {
    begin_ = offset;
    first_line_ = number;
  }
  if (closing.steps != steps_)
    throw Error(ErrorKind::bad_input, place + ": trial " + closing.trial.trial + " has " + std::to_string(steps_) +
                                          " step lines, but its closing line counts " + std::to_string(closing.steps));
  steps_ = 0;
  closed_ = std::move(closing.trial);
  return true;
}

void BlockFinder::abandon() {
  if (steps_ > 0) incomplete_.push_back(trial_);
  steps_ = 0;
}

std::vector<std::string> BlockFinder::take_incomplete() {
  abandon();
  return std::move(incomplete_);
}

Blocks split_trials(std::string_view text, const std::string& file_name) {
  Blocks split;
  BlockFinder finder(file_name);
  std::size_t line_number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t newline = text.find('\n', at);
    ++line_number;
    if (newline == std::string_view::npos) break;  // half-written
    const std::string_view line = text.substr(at, newline - at);
    if (finder.add(line, at, line_number)) {
      split.blocks.push_back({finder.closed().trial, text.substr(finder.begin(), newline + 1 - finder.begin()), line,
                              finder.first_line()});
      split.whole = newline + 1;
    }
    at = newline + 1;
  }
  split.incomplete = finder.take_incomplete();
  return split;
}

Blocks split_times(std::string_view text, const std::string& file_name) {
  Blocks split;
  std::size_t line_number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t newline = text.find('\n', at);
    ++line_number;
    if (newline == std::string_view::npos) break;  // half-written
    const std::string_view line = text.substr(at, newline - at);
    const TrialTimes times = read_times_line(line, file_name + ":" + std::to_string(line_number));
    split.blocks.push_back({times.trial, text.substr(at, newline + 1 - at), line, line_number});
    at = newline + 1;
    split.whole = at;
  }
  return split;
}

std::size_t append_block(const fs::path& file, std::string_view block, bool flush) {
  const auto fail = [&file](int reason) {
    throw Error(ErrorKind::io, "cannot write '" + file.string() + "': " + std::strerror(reason));
  };
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0) fail(errno);
  struct stat before {};
  int reason = ::fstat(descriptor, &before) == 0 ? 0 : errno;
  while (reason == 0 && !block.empty()) {
    const ssize_t written = ::write(descriptor, block.data(), block.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0)
      reason = errno;
    else if (written == 0)
      reason = EIO;
    else
      block.remove_prefix(static_cast<std::size_t>(written));  // writing the rest again yields the reason as errno
  }
  if (reason == 0 && flush && ::fdatasync(descriptor) != 0 && errno != EINVAL) reason = errno;
  // If this fails too, the half-written tail is cut off when the folder is opened the next time.
  if (reason != 0 && ::ftruncate(descriptor, before.st_size) != 0) {
  }
  if (::close(descriptor) != 0 && reason == 0) reason = errno;
  if (reason != 0) fail(reason);
  return static_cast<std::size_t>(before.st_size);
}

void cut_file(const fs::path& file, std::size_t size) {
  if (::truncate(file.c_str(), static_cast<off_t>(size)) != 0)
    throw Error(ErrorKind::io, "cannot cut '" + file.string() + "': " + std::strerror(errno));
}

}  // namespace relign::records
