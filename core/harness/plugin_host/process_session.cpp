#include "plugin_host/process_session.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
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

}  // namespace

std::vector<pid_t> processes_of_session(pid_t session) {
  std::vector<pid_t> found;
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
    long parent = 0, group = 0, of = 0;
    if (std::sscanf(stat.c_str() + name_end + 1, " %c %ld %ld %ld", &state, &parent, &group, &of) != 4) continue;
    if (of == session && state != 'Z' && state != 'X') found.push_back(process);
  }
  ::closedir(folder);
  return found;
}

void kill_session(pid_t session, pid_t spared) {
  // A process may have started another one just before it was killed.
  constexpr int kMaxRounds = 20;
  for (int round = 0; round < kMaxRounds; ++round) {
    bool any = false;
    for (const pid_t process : processes_of_session(session)) {
      if (process == spared) continue;
      any = true;
      ::kill(process, SIGKILL);
    }
    if (!any) return;
    ::usleep(500);
  }
}

std::size_t resident_bytes(pid_t process) {
  const std::string statm = read_of(process, "statm");
  unsigned long all = 0, resident = 0;
  if (std::sscanf(statm.c_str(), "%lu %lu", &all, &resident) != 2) return 0;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace relign::plugin_host
