#include "runner/trial_journal.h"

#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "base/error.h"
#include "base/json_source.h"
#include "base/text.h"

namespace relign::runner {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
constexpr std::uint64_t kDigestOfNothing = 14695981039346656037ULL;

std::uint64_t add_to_digest(std::uint64_t digest, std::string_view bytes) {
  for (const char byte : bytes) digest = (digest ^ static_cast<unsigned char>(byte)) * 1099511628211ULL;
  return digest;
}

[[noreturn]] void fail(const char* what) {
  throw Error(ErrorKind::io, std::string("a trial's journal in memory cannot be ") + what + ": " +
                                 std::generic_category().message(errno));
}

// From this place to the end.
std::string rest_of(int file, std::uint64_t place) {
  std::string text;
  char buffer[1 << 16];
  while (true) {
    const ssize_t got = ::pread(file, buffer, sizeof buffer, static_cast<off_t>(place + text.size()));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read");
    if (got == 0) return text;
    text.append(buffer, static_cast<std::size_t>(got));
    if (text.size() > kMaxBytes) return text;  // longer than any trial: a plugin has extended the file
  }
}

std::string all_of(int file) { return rest_of(file, 0); }

// Escapes line ends and keeps all other bytes, because an entry is one line.
std::string escaped(std::string_view text) {
  std::string line;
  for (const char letter : text) {
    if (letter == '\n')
      line += "\\n";
    else if (letter == '\\')
      line += "\\\\";
    else
      line += letter;
  }
  return line;
}

std::string unescaped(std::string_view line) {
  std::string text;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool code = line[i] == '\\' && i + 1 < line.size();
    text += !code ? line[i] : line[++i] == 'n' ? '\n' : line[i];
  }
  return text;
}

// Reads one entry; false for a malformed one.
bool take(std::string_view line, const std::string& trial, bool checked, Journal& journal) {
  if (line.empty()) return false;
  const std::string_view rest = line.substr(1);
  if (line.front() == 'S') {
    if (checked) {
      const records::ReadLine read = records::read_trial_line(rest, "the journal");
      if (read.closing || read.trial.trial != trial || read.step.step != journal.steps) return false;
    }
    journal.step_lines.append(rest).push_back('\n');
    ++journal.steps;
    return true;
  }
  if (line.front() == 'L') {
    journal.log += unescaped(rest);
    return true;
  }
  const Json value = parsed_json(rest);
  if (line.front() == 'T' && value.is_array() && value.size() == 3) {
    journal.times.algorithm_seconds.push_back(value[0].get<double>());
    journal.times.simulation_seconds.push_back(value[1].get<double>());
    journal.times.truth_seconds.push_back(value[2].get<double>());
    return true;
  }
  return false;
}

}  // namespace

void JournalWriter::begin() {
  size_ = 0;
  digest_ = kDigestOfNothing;
}

void JournalWriter::add_step(const std::string& trial, const records::StepRecord& step, double algorithm_seconds,
                             double simulation_seconds, double truth_seconds) {
  write("S" + records::step_line(trial, step) + "\nT[" + shortest(algorithm_seconds) + "," +
        shortest(simulation_seconds) + "," + shortest(truth_seconds) + "]\n");
}

void JournalWriter::add_log(std::string_view text) { write("L" + escaped(text) + "\n"); }

void JournalWriter::write_text(const std::string& text) {
  begin();
  write(text);
}

void JournalWriter::write(const std::string& line) {
  const std::lock_guard<std::mutex> hold(mutex_);
  digest_ = add_to_digest(digest_, line);
  std::string_view left = line;
  while (!left.empty()) {
    const ssize_t written = ::pwrite(file_, left.data(), left.size(), static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("written");
    size_ += static_cast<std::uint64_t>(written);
    left.remove_prefix(static_cast<std::size_t>(written));
  }
}

void clear_journal(int file) {
  if (::ftruncate(file, 0) != 0) fail("emptied");
}

std::size_t StepCounter::count(int file) {
  const std::string text = rest_of(file, size_);
  size_ += text.size();
  for (const char byte : text) {
    if (before_ == '\n' && byte == 'S') ++steps_;
    before_ = byte;
  }
  return steps_;
}

JournalText read_journal_text(int file) {
  JournalText read;
  read.text = all_of(file);
  read.digest = add_to_digest(kDigestOfNothing, read.text);
  return read;
}

Journal read_journal(int file, const std::string& trial, bool checked) {
  const std::string text = all_of(file);
  Journal journal;
  journal.times.trial = trial;
  journal.size = text.size();
  journal.digest = add_to_digest(kDigestOfNothing, text);
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    try {
      if (!take(std::string_view(text).substr(begin, end - begin), trial, checked, journal)) break;
    } catch (const std::exception&) {
      break;
    }
  }
  // A worker may have died between the two lines of a step.
  for (auto* seconds :
       {&journal.times.algorithm_seconds, &journal.times.simulation_seconds, &journal.times.truth_seconds})
    seconds->resize(journal.steps, 0.0);
  return journal;
}

}  // namespace relign::runner
