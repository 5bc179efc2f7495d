// Runs the built program and captures stdout, stderr and the exit code.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace relign::cli_test {

struct Outcome {
  int exit_code = -1;  // 128 + number when a signal ended it
  std::string out;
  std::string err;
};

// Working directory of one test: a new folder, removed afterwards.
class Workplace {
 public:
  Workplace();
  ~Workplace();
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const;
  std::string read(const std::string& name) const;

 private:
  std::filesystem::path folder_;
};

struct Options {
  std::map<std::string, std::string> environment;  // added to the test's own
  int stderr_fd = -1;                              // receives stderr instead of Outcome::err if not -1
};

// A running program.
class Running {
 public:
  Running(const Workplace& place, std::vector<std::string> command, const Options& options = {});
  ~Running();  // kills it if it still runs
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  void send(int signal) const;
  bool ended();
  Outcome wait();

 private:
  std::filesystem::path out_, err_;
  pid_t process_ = -1;
  int status_ = 0;
};

// Runs relign-bench with these arguments.
Outcome relign_bench(const Workplace& place, const std::vector<std::string>& arguments, const Options& options = {});

// Runs a shell script, in which "$RELIGN_BENCH" is the program.
Outcome shell(const Workplace& place, const std::string& script);

// 3 algorithms, 2 noise levels, 2 instances, 3 steps, on the paper's lens: 12 trials.
extern const char* const kTinySuite;
// The same with two algorithms: 8 trials.
extern const char* const kSmallestSuite;

}  // namespace relign::cli_test
