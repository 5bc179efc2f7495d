#include "cli/program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

extern char** environ;

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;

std::string read_all(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// The test's environment without variables that change the program's behaviour.
std::vector<std::string> environment_with(const std::map<std::string, std::string>& added) {
  std::map<std::string, std::string> all;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const char* equals = std::strchr(*entry, '=');
    if (equals != nullptr) all[std::string(*entry, static_cast<std::size_t>(equals - *entry))] = equals + 1;
  }
  all.erase("RELIGN_PLUGIN_PATH");
  all.erase("NO_COLOR");
  all["RELIGN_BENCH"] = RELIGN_PROGRAM;
  for (const auto& [name, value] : added) all[name] = value;
  std::vector<std::string> lines;
  for (const auto& [name, value] : all) lines.push_back(name + "=" + value);
  return lines;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> raw;
  for (std::string& text : texts) raw.push_back(text.data());
  raw.push_back(nullptr);
  return raw;
}

}  // namespace

const char* const kTinySuite = R"({
  "name": "tiny", "scenes": ["relign_od"], "noise_levels": ["rho0", "rho0.5"],
  "algorithms": ["random", "home", "nlopt-sbplx"], "instances": 2, "steps": 3
})";

const char* const kSmallestSuite = R"({
  "name": "tiny", "scenes": ["relign_od"], "noise_levels": ["rho0", "rho0.5"],
  "algorithms": ["random", "home"], "instances": 2, "steps": 3
})";

Workplace::Workplace() {
  std::string pattern = (fs::path(testing::TempDir()) / "relign_cli_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make " + pattern);
  folder_ = pattern;
}

Workplace::~Workplace() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void Workplace::write(const std::string& name, const std::string& text) const {
  fs::create_directories(path(name).parent_path());
  std::ofstream(path(name), std::ios::binary) << text;
}

std::string Workplace::read(const std::string& name) const { return read_all(path(name)); }

Running::Running(const Workplace& place, std::vector<std::string> command, const Options& options) {
  static int count = 0;
  out_ = place.path(".stdout-" + std::to_string(count));
  err_ = place.path(".stderr-" + std::to_string(count++));
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (options.stderr_fd >= 0)
    posix_spawn_file_actions_adddup2(&files, options.stderr_fd, STDERR_FILENO);
  else
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addchdir_np(&files, place.folder().c_str());
  std::vector<std::string> environment = environment_with(options.environment);
  const int failure = posix_spawn(&process_, command.front().c_str(), &files, nullptr, pointers(command).data(),
                                  pointers(environment).data());
  posix_spawn_file_actions_destroy(&files);
  if (failure != 0) {
    process_ = -1;
    throw std::runtime_error("cannot start " + command.front() + ": " + std::strerror(failure));
  }
}

Running::~Running() {
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

void Running::send(int signal) const { kill(process_, signal); }

bool Running::ended() {
  if (process_ > 0 && waitpid(process_, &status_, WNOHANG) == process_) process_ = -1;
  return process_ < 0;
}

Outcome Running::wait() {
  if (process_ > 0) waitpid(process_, &status_, 0);
  process_ = -1;
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  outcome.out = read_all(out_);
  outcome.err = read_all(err_);
  return outcome;
}

Outcome relign_bench(const Workplace& place, const std::vector<std::string>& arguments, const Options& options) {
  std::vector<std::string> command = {RELIGN_PROGRAM};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return Running(place, command, options).wait();
}

Outcome shell(const Workplace& place, const std::string& script) {
  return Running(place, {"/bin/sh", "-c", script}).wait();
}

}  // namespace relign::cli_test
