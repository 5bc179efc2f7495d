// Runs the built program as a user does and keeps what it said, stdout and stderr apart.
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

// A folder for one test: fresh, removed afterwards, and the program's working directory.
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
  int stderr_fd = -1;                              // where stderr goes instead of Outcome::err
};

// A program under way.
class Running {
 public:
  Running(const Workplace& place, std::vector<std::string> command, const Options& options = {});
  ~Running();  // kills what is still there
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

// relign-bench with these arguments.
Outcome relign_bench(const Workplace& place, const std::vector<std::string>& arguments, const Options& options = {});

// A shell script; "$RELIGN_BENCH" is the program.
Outcome shell(const Workplace& place, const std::string& script);

// The same suite again and again: 2 instances, 3 steps, two levels, on the paper's lens.
extern const char* const kTinySuite;
// Two algorithms of it alone: 8 trials of 4 instances.
extern const char* const kSmallestSuite;

}  // namespace relign::cli_test
