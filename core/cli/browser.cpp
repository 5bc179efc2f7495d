#include "cli/browser.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "base/files.h"
#include "base/shell_words.h"
#include "base/text.h"

namespace relign::cli {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// Of a program's end; a browser that is still running then shows the page.
constexpr auto kPatience = std::chrono::seconds(5);

bool starts(const std::vector<std::string>& command) {
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&files, stream, "/dev/null", O_RDWR, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  pid_t child = 0;
  const bool spawned = ::posix_spawnp(&child, words[0], &files, &attributes, words.data(), environ) == 0;
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (!spawned) return false;
  for (const auto until = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < until;) {
    int status = 0;
    if (::waitpid(child, &status, WNOHANG) == child) return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

// The command of one entry of $BROWSER.
std::vector<std::string> command_of(const std::string& browser, const std::string& page) {
  std::vector<std::string> words;
  bool has_page = false;
  for (std::size_t at = 0; at <= browser.size();) {
    const std::size_t end = std::min(browser.find(' ', at), browser.size());
    std::string word = browser.substr(at, end - at);
    at = end + 1;
    if (word.empty()) continue;
    if (const std::size_t place = word.find("%s"); place != std::string::npos) {
      word.replace(place, 2, page);
      has_page = true;
    }
    words.push_back(word);
  }
  if (!has_page) words.push_back(page);
  return words;
}

// Why no browser has the page; empty: one has it.
std::string problem_opening(const std::string& page) {
  const std::string browsers = variable("BROWSER");
  for (std::size_t at = 0; at < browsers.size();) {
    const std::size_t end = std::min(browsers.find(':', at), browsers.size());
    if (end > at && starts(command_of(browsers.substr(at, end - at), page))) return "";
    at = end + 1;
  }
  if (!browsers.empty()) return "no program of BROWSER='" + browsers + "' could open the page";
  if (variable("DISPLAY").empty() && variable("WAYLAND_DISPLAY").empty())
    return variable("SSH_CONNECTION").empty() ? "no display here" : "no display in this SSH session";
  if (program_on_path("xdg-open").empty()) return "xdg-open is not installed (Debian package xdg-utils)";
  return starts({"xdg-open", page}) ? "" : "xdg-open could not open the page";
}

}  // namespace

bool open_in_browser(const std::filesystem::path& page) {
  const std::string path = std::filesystem::absolute(page).lexically_normal().string();
  const std::string problem = problem_opening(path);
  if (problem.empty()) return true;
  char host[HOST_NAME_MAX + 1] = "";
  ::gethostname(host, sizeof host - 1);
  std::fprintf(stderr,
               "Not opened: %s. The page is one file; to see it on your own machine, copy it from there:\n  scp %s .\n",
               printable(problem).c_str(), shell_quoted(std::string(host) + ":" + path).c_str());
  return false;
}

}  // namespace relign::cli
