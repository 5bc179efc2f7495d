// The project's exception type, and the mistakes collected while a user's file is read.
//
// Error is the only exception that the modules throw on purpose. Its kind sets the exit code of the
// program; its text gives what was found, where, what is allowed and what to do.
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace relign {

enum class ErrorKind {
  bad_input,        // invalid arguments, suite or data file: exit code 2
  plugin_rejected,  // a plugin was not found, could not be loaded or failed a check: exit code 5
  plugin_failed,    // a plugin failed while it ran: a trial outcome, outside trials exit code 1
  io,               // a file or folder cannot be read or written: exit code 2
  stopped,          // stopped by the user or a signal: exit code 75 or 130
  internal          // a bug in this program: exit code 1
};

inline constexpr std::size_t kLongestError = 100'000;  // bytes
inline constexpr std::size_t kMaxProblems = 100;

// Messages quote untrusted files: what() is UTF-8 without control characters other than line ends and tabs, and is
// truncated to kLongestError bytes.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message);
  ErrorKind kind() const { return kind_; }

 private:
  ErrorKind kind_;
};

// One mistake in a user's file. line and column count from 1; 0 if unknown.
struct Problem {
  std::string file;
  int line = 0;
  int column = 0;
  std::string pointer;  // JSON pointer, empty outside JSON
  std::string message;  // what was found, what is allowed, nearest name

  // "suite.json:14:9: /algorithms/2: unknown algorithm 'bo-pg'; did you mean 'bo-gp'?"
  std::string to_string() const;
};

// Error(bad_input) that lists the problems, one per line: the first kMaxProblems and the number of further ones.
class ProblemsError : public Error {
 public:
  explicit ProblemsError(const std::vector<Problem>& problems);
  const std::vector<Problem>& problems() const { return *problems_; }

 private:
  std::shared_ptr<const std::vector<Problem>> problems_;  // exceptions are copied
};

// Throws ProblemsError; does nothing if `problems` is empty.
void throw_if_any(const std::vector<Problem>& problems);

}  // namespace relign
