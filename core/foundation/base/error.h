// Failures as values a user can act on.
//
// Error is the only exception our rooms throw on purpose. Its kind decides the exit code of the
// program; its text says what was found, where, what is allowed and what to do.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace relign {

enum class ErrorKind {
  bad_input,       // arguments, suite or data file of the user: exit code 2
  plugin_refused,  // a plugin could not be found, loaded or trusted: exit code 5
  plugin_failed,   // a plugin reported a failure while it worked: a trial outcome, else exit code 1
  io,              // a folder or file cannot be read or written: exit code 2
  stopped,         // the user or a signal asked to stop: exit code 75 or 130
  internal         // a rule of ours was broken: exit code 1
};

inline constexpr std::size_t kLongestError = 100'000;  // bytes
inline constexpr std::size_t kMostProblems = 100;

// Messages quote files of strangers: what() is UTF-8 without control characters but line ends and tabs, and is cut
// after kLongestError bytes.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message);
  ErrorKind kind() const { return kind_; }

 private:
  ErrorKind kind_;
};

// One mistake in a user's file. line and column count from 1; 0 when the place is unknown.
struct Problem {
  std::string file;
  int line = 0;
  int column = 0;
  std::string pointer;  // JSON pointer, empty outside JSON
  std::string message;  // found, allowed, nearest name

  // "suite.json:14:9: /algorithms/2: unknown algorithm 'bo-pg'; did you mean 'bo-gp'?"
  std::string to_string() const;
};

// Throws one Error (bad_input) that lists the problems, one a line: the first kMostProblems, and how many more there
// are. Does nothing without any.
void throw_if_any(const std::vector<Problem>& problems);

}  // namespace relign
