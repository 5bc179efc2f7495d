#include "records/line_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "records/checksum.h"
#include "records/record.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view kStepStart = "{\"trial\":\"";
constexpr std::size_t kIdDigits = 16;

// "0000.jsonl" -> 0; false for any other name. Throws Error for "00000.jsonl": two files of one number would be read as
// one.
bool file_number(const fs::path& file, std::size_t& number) {
  const std::string stem = file.stem().string();
  if (file.extension() != ".jsonl" || stem.empty() || stem.size() > 9) return false;
  if (stem.find_first_not_of("0123456789") != std::string::npos) return false;
  number = std::stoul(stem);
  if (const std::string name = line_file_name(number); file.filename() != name)
    throw Error(ErrorKind::bad_input,
                "'" + file.string() + "' is not a file of records; expected the name '" + name + "'");
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

// The id in a line that cannot be read; "" where there is none.
std::string id_in(std::string_view line) {
  constexpr std::string_view key = "\"trial\":\"";
  const std::size_t at = line.find(key);
  if (at == std::string_view::npos) return "";
  const std::string_view id = line.substr(at + key.size(), kIdDigits + 1);
  const bool whole =
      id.size() == kIdDigits + 1 && id.back() == '"' && id.find_first_not_of("0123456789abcdef") == kIdDigits;
  return whole ? std::string(id.substr(0, kIdDigits)) : "";
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
    std::error_code unknown;
    if (file_number(entry->path(), number) && entry->is_regular_file(unknown))
      found.emplace_back(number, entry->path());
  }
  if (code && code != std::errc::no_such_file_or_directory)
    throw Error(ErrorKind::io, "cannot read '" + folder.string() + "': " + code.message());
  std::sort(found.begin(), found.end());
  std::vector<fs::path> files;
  for (auto& [number, path] : found) files.push_back(std::move(path));
  return files;
}

std::vector<std::string> odd_line_files(const fs::path& folder) {
  std::vector<std::string> found;
  std::error_code code;
  if (fs::is_symlink(folder, code)) found.push_back(in_quotes(folder.filename().string()) + " is a link, not a folder");
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const fs::path& file = entry->path();
    std::size_t number = 0;
    const std::string name = in_quotes((folder.filename() / file.filename()).string());
    if (file.extension() == ".jsonl" && (!file_number(file, number) || !entry->is_regular_file(code)))
      found.push_back(name + " is not a file of records, and is not read");
    else if (file.extension() == ".jsonl" && entry->is_symlink(code))
      found.push_back(name + " is a link, not a file");
  }
  std::sort(found.begin(), found.end());
  return found;
}

void BlockFinder::begin_block(std::size_t offset, std::size_t number) {
  begin_ = offset;
  first_line_ = number;
  hash_.begin();
}

BlockFinder::Line BlockFinder::add(std::string_view line, std::size_t offset, std::size_t number) {
  std::string_view step_of;
  bool first = false;
  if (step_line(line, step_of, first)) {
    if (steps_ == 0 || step_of != trial_ || first) {
      abandon();
      trial_ = step_of;
      begin_block(offset, number);
    }
    ++steps_;
    hash_.add(line);
    hash_.add("\n");
    return Line::step;
  }
  std::optional<ReadLine> read;
  std::string why = "expected a step or a closing line";
  try {
    read = read_trial_line(line, "");
  } catch (const NewerFormat& error) {
    throw NewerFormat(file_name_ + ":" + std::to_string(number) + ": " + error.what());
  } catch (const Error& error) {
    why = error.what();
  }
  if (read && read->closing) return close(line, offset, number, std::move(*read));
  if (steps_ == 0) return damage(number, id_in(line), why);
  if (unreadable_ == 0) {  // within a block, or the closing line of one
    unreadable_ = number;
    why_unreadable_ = why;
  }
  return Line::damaged;
}

BlockFinder::Line BlockFinder::close(std::string_view line, std::size_t offset, std::size_t number, ReadLine closing) {
  if (steps_ > 0 && closing.trial.trial != trial_) abandon();
  if (steps_ == 0) begin_block(offset, number);
  // The steps of this trial before a damaged line are part of its damage.
  const auto refuse = [&](std::size_t at, const std::string& why) {
    unclosed_.erase(std::remove_if(unclosed_.begin(), unclosed_.end(),
                                   [&](const Damage& one) { return one.trial == closing.trial.trial; }),
                    unclosed_.end());
    return damage(at, closing.trial.trial, why);
  };
  const std::size_t steps = std::exchange(steps_, 0), unreadable = std::exchange(unreadable_, 0);
  if (unreadable > 0) return refuse(unreadable, why_unreadable_);
  if (closing.steps != steps)
    return refuse(number, "it has " + std::to_string(steps) + " step lines, but its closing line counts " +
                              std::to_string(closing.steps));
  const SealedLine split = split_checksum(line);
  if (split.checksum.empty()) return refuse(number, "its closing line has no checksum that can be read");
  hash_.add(split.body);
  hash_.add("}\n");
  if (hash_.hex() != split.checksum) return refuse(number, "its lines do not have the checksum on its closing line");
  closed_ = std::move(closing.trial);
  closed_steps_ = steps;
  // Only the end of a file can be half-written: the next run cuts it off before it appends.
  damaged_.insert(damaged_.end(), unclosed_.begin(), unclosed_.end());
  unclosed_.clear();
  return Line::closing;
}

BlockFinder::Line BlockFinder::damage(std::size_t number, std::string trial, std::string what) {
  damaged_.push_back({file_name_, number, std::move(trial), std::move(what)});
  return Line::damaged;
}

void BlockFinder::abandon() {
  if (const std::size_t unreadable = std::exchange(unreadable_, 0); unreadable > 0)
    damage(unreadable, trial_, why_unreadable_);
  else if (steps_ > 0)
    unclosed_.push_back({file_name_, first_line_, trial_, "it has no closing line"});
  steps_ = 0;
}

std::vector<std::string> BlockFinder::take_incomplete() {
  abandon();
  std::vector<std::string> incomplete;
  for (const Damage& one : unclosed_) incomplete.push_back(one.trial);
  return incomplete;
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
    const BlockFinder::Line found = finder.add(line, at, line_number);
    if (found != BlockFinder::Line::step) split.whole = newline + 1;
    if (found == BlockFinder::Line::closing)
      split.blocks.push_back({finder.closed().trial, text.substr(finder.begin(), newline + 1 - finder.begin()), line,
                              finder.first_line()});
    at = newline + 1;
  }
  split.incomplete = finder.take_incomplete();
  split.damaged = finder.take_damaged();
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
    if (std::optional<Damage> damage = damaged_times(line, file_name, line_number))
      split.damaged.push_back(std::move(*damage));
    else
      split.blocks.push_back({read_times_line(line, "").trial, text.substr(at, newline + 1 - at), line, line_number});
    at = newline + 1;
    split.whole = at;
  }
  return split;
}

std::optional<Damage> damaged_times(std::string_view line, const std::string& file_name, std::size_t number) {
  try {
    const TrialTimes times = read_times_line(line, "");
    if (line_is_intact(line)) return std::nullopt;
    return Damage{file_name, number, times.trial, "the line does not have its checksum", true};
  } catch (const NewerFormat& error) {
    throw NewerFormat(file_name + ":" + std::to_string(number) + ": " + error.what());
  } catch (const Error& error) {
    return Damage{file_name, number, id_in(line), error.what(), true};
  }
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
