#include "plugin_host/process_session.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <string>

namespace relign::plugin_host {
namespace {

// Reads a file of /proc, which is small; empty when the process has ended.
std::string read_of(pid_t process, const char* name) {
  const std::string path = "/proc/" + std::to_string(process) + "/" + name;
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  char text[1024];
  const ssize_t got = ::read(file, text, sizeof text);
  ::close(file);
  return got > 0 ? std::string(text, static_cast<std::size_t>(got)) : std::string();
}

struct Process {
  pid_t number;
  char state;  // 'Z': ended, waits to be reaped
  pid_t parent, session;
};

std::vector<Process> all_processes() {
  std::vector<Process> found;
  DIR* const folder = ::opendir("/proc");
  if (!folder) return found;
  while (const dirent* entry = ::readdir(folder)) {
    if (entry->d_name[0] < '1' || entry->d_name[0] > '9') continue;
    const auto process = static_cast<pid_t>(std::atol(entry->d_name));
    const std::string stat = read_of(process, "stat");
    // "12 (name with any characters) S parent group session ..."
    const std::size_t name_end = stat.rfind(')');
    if (name_end == std::string::npos) continue;
    char state = 0;
    long parent = 0, group = 0, session = 0;
    if (std::sscanf(stat.c_str() + name_end + 1, " %c %ld %ld %ld", &state, &parent, &group, &session) == 4)
      found.push_back({process, state, static_cast<pid_t>(parent), static_cast<pid_t>(session)});
  }
  ::closedir(folder);
  return found;
}

// `roots` and all that descends from them.
std::set<pid_t> with_descendants(std::set<pid_t> roots, const std::vector<Process>& processes) {
  for (bool grown = true; grown;) {
    grown = false;
    for (const Process& process : processes)
      if (roots.count(process.parent) && roots.insert(process.number).second) grown = true;
  }
  return roots;
}

// A process may have started another one just before it was killed.
constexpr int kMaxRounds = 20;
constexpr useconds_t kRoundMicroseconds = 500;

struct Children {
  std::mutex mutex;  // held while a child is started, so that it is never taken for an orphan
  std::set<pid_t> started;
  bool adopting = false;
};

Children& children() {
  static auto* all = new Children;  // destructors of static objects may end children
  return *all;
}

// Adds the numbers in a file of /proc, if the kernel has it.
bool add_children(const std::string& file, std::set<pid_t>& found) {
  std::ifstream numbers(file);
  if (!numbers) return false;
  for (pid_t child = 0; numbers >> child;) found.insert(child);
  return true;
}

// Looked up for every trial, so that a look at all processes of a large machine would be too long.
std::set<pid_t> own_children() {
  std::set<pid_t> found;
  bool complete = false;
  if (DIR* const threads = ::opendir("/proc/self/task")) {
    complete = true;
    while (const dirent* entry = ::readdir(threads))
      if (entry->d_name[0] != '.' &&
          !add_children("/proc/self/task/" + std::string(entry->d_name) + "/children", found))
        complete = false;  // or this thread has just ended
    ::closedir(threads);
  }
  if (!complete)
    for (const Process& process : all_processes())
      if (process.parent == ::getpid()) found.insert(process.number);
  return found;
}

std::set<pid_t> find_orphans() {
  const Children& known = children();
  if (!known.adopting) return {};
  std::set<pid_t> found = own_children();
  for (const pid_t process : known.started) found.erase(process);
  return found;
}

}  // namespace

std::vector<pid_t> processes_of_session(pid_t session) {
  std::vector<pid_t> found;
  for (const Process& process : all_processes())
    if (process.session == session && process.state != 'Z' && process.state != 'X') found.push_back(process.number);
  return found;
}

void kill_session(pid_t session, pid_t spared) {
  for (int round = 0; round < kMaxRounds; ++round) {
    bool any = false;
    for (const pid_t process : processes_of_session(session)) {
      if (process == spared) continue;
      any = true;
      ::kill(process, SIGKILL);
    }
    if (!any) return;
    ::usleep(kRoundMicroseconds);
  }
}

std::size_t resident_bytes(pid_t process) {
  const std::string statm = read_of(process, "statm");
  unsigned long all = 0, resident = 0;
  if (std::sscanf(statm.c_str(), "%lu %lu", &all, &resident) != 2) return 0;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

void adopt_orphans() {
  const std::lock_guard<std::mutex> lock(children().mutex);
  children().adopting = ::prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0;
}

pid_t start_child(const std::function<pid_t()>& start) {
  const std::lock_guard<std::mutex> lock(children().mutex);
  const pid_t process = start();
  if (process > 0) children().started.insert(process);
  return process;
}

void forget_child(pid_t process) {
  const std::lock_guard<std::mutex> lock(children().mutex);
  children().started.erase(process);
}

bool has_ended(pid_t child) {
  siginfo_t info{};
  const int result = ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT);
  return result != 0 ? errno != EINTR : info.si_pid == child;
}

void end_children() {
  std::set<pid_t> left;
  {
    const std::lock_guard<std::mutex> lock(children().mutex);
    left = children().started;
  }
  std::erase_if(left, has_ended);
  for (const pid_t process : left) ::kill(process, SIGTERM);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kSecondsToExit);
  while (!left.empty() && std::chrono::steady_clock::now() < deadline) {
    ::usleep(kRoundMicroseconds);
    std::erase_if(left, has_ended);
  }
}

std::set<pid_t> orphans() {
  const std::lock_guard<std::mutex> lock(children().mutex);
  return find_orphans();
}

void kill_orphans(const std::set<pid_t>& spared) {
  const std::lock_guard<std::mutex> lock(children().mutex);
  for (int round = 0; round < kMaxRounds; ++round) {
    std::set<pid_t> ours = find_orphans();
    for (const pid_t process : spared) ours.erase(process);
    if (ours.empty()) return;
    for (const pid_t process : with_descendants(ours, all_processes())) ::kill(process, SIGKILL);
    for (const pid_t process : ours) ::waitpid(process, nullptr, WNOHANG);
    ::usleep(kRoundMicroseconds);
  }
}

void kill_descendants() {
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<Process> processes = all_processes();
    const std::set<pid_t> ours = with_descendants({::getpid()}, processes);
    bool any = false;
    for (const Process& process : processes) {
      if (process.number == ::getpid() || process.state == 'Z' || !ours.count(process.number)) continue;
      any = true;
      ::kill(process.number, SIGKILL);
    }
    if (!any) return;
    ::usleep(kRoundMicroseconds);
  }
}

}  // namespace relign::plugin_host
