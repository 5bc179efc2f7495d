#include "keeper.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <thread>

namespace relign::cluster_test {
namespace {

namespace fs = std::filesystem;

std::vector<Process> living() {
  std::vector<Process> all;
  std::error_code code;
  for (fs::directory_iterator entry("/proc", code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry->path() / "stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t closing = text.rfind(')');
    if (closing == std::string::npos || closing + 4 > text.size() || text[closing + 2] == 'Z') continue;
    Process process;
    process.id = std::stoi(name);
    process.parent = std::stoi(text.substr(closing + 4));
    // An iterator over the buffer would throw when the process ends between opening and reading (ESRCH).
    std::ifstream words(entry->path() / "cmdline");
    std::getline(words, process.command);
    std::replace(process.command.begin(), process.command.end(), '\0', ' ');
    all.push_back(process);
  }
  return all;
}

std::vector<Process> below(pid_t root) {
  const std::vector<Process> all = living();
  std::set<pid_t> known = {root};
  std::vector<Process> found;
  for (bool grown = true; grown;) {
    grown = false;
    for (const Process& process : all) {
      if (known.count(process.parent) == 0 || !known.insert(process.id).second) continue;
      found.push_back(process);
      grown = true;
    }
  }
  return found;
}

pid_t start_here(std::string words) {
  std::vector<char*> pointers;
  for (std::size_t at = 0; at < words.size(); at += std::char_traits<char>::length(&words[at]) + 1)
    pointers.push_back(&words[at]);
  pointers.push_back(nullptr);
  const pid_t process = ::fork();
  if (process != 0) return process;
  ::signal(SIGCHLD, SIG_DFL);
  ::execv(pointers.front(), pointers.data());
  ::_exit(127);
}

// One message is one command; the answer is a process id. The connection closes when the test ends.
[[noreturn]] void keep(int connection) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  ::signal(SIGCHLD, SIG_IGN);  // leaves no zombies
  std::array<char, 8192> message;
  while (true) {
    const ssize_t size = ::recv(connection, message.data(), message.size(), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    const pid_t process = start_here(std::string(message.data(), static_cast<std::size_t>(size)));
    ::send(connection, &process, sizeof process, MSG_NOSIGNAL);
  }
  for (std::vector<Process> left = below(::getpid()); !left.empty(); left = below(::getpid())) {
    for (const Process& process : left) ::kill(process.id, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ::_exit(0);
}

}  // namespace

std::vector<pid_t> without_starting_children(const std::vector<Process>& processes) {
  std::vector<pid_t> found;
  for (const Process& process : processes)
    if (std::none_of(processes.begin(), processes.end(),
                     [&process](const Process& other) { return other.id == process.parent; }))
      found.push_back(process.id);
  return found;
}

// Forks twice, into a session of its own: this process survives when the test is killed with all its children (by ctest
// after a timeout), and ends the remaining processes.
Keeper::Keeper() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) throw std::runtime_error("no socketpair");
  const pid_t parent = ::fork();
  if (parent < 0) throw std::runtime_error("cannot fork");
  if (parent == 0) {
    const pid_t keeper = ::fork();
    if (keeper != 0) {
      if (keeper < 0) ::_exit(1);
      ::send(ends[1], &keeper, sizeof keeper, MSG_NOSIGNAL);
      ::_exit(0);
    }
    ::close(ends[0]);
    ::setsid();
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
    keep(ends[1]);
  }
  ::close(ends[1]);
  connection_ = ends[0];
  ::waitpid(parent, nullptr, 0);
  if (::recv(connection_, &process_, sizeof process_, 0) != sizeof process_) throw std::runtime_error("no keeper");
}

Keeper::~Keeper() {
  ::shutdown(connection_, SHUT_WR);
  char nothing = 0;
  while (::recv(connection_, &nothing, 1, 0) > 0) {  // it closes its end when everything has ended
  }
  ::close(connection_);
}

pid_t Keeper::start(const std::vector<std::string>& command) const {
  std::string words;
  for (const std::string& word : command) words += word + '\0';
  pid_t process = -1;
  if (::send(connection_, words.data(), words.size(), MSG_NOSIGNAL) < 0 ||
      ::recv(connection_, &process, sizeof process, 0) != sizeof process || process < 0)
    throw std::runtime_error("cannot start " + command.front());
  return process;
}

std::vector<Process> Keeper::kept() const { return below(process_); }

bool Keeper::alive(pid_t process) const {
  const std::vector<Process> all = kept();
  return std::any_of(all.begin(), all.end(), [process](const Process& one) { return one.id == process; });
}

}  // namespace relign::cluster_test
